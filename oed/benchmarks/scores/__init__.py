"""Scores of answers against the sealed truth."""

from oed.benchmarks.scores.scoring import Scores, score_benchmark

__all__ = ["Scores", "score_benchmark"]
