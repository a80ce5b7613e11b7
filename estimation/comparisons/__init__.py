"""Identified models against each other: which differences are real, drift over runs, and a merged estimate."""

from estimation.comparisons.comparing import compare
from estimation.comparisons.log_runs import identify_runs
from estimation.comparisons.result import ModelComparison
from estimation.comparisons.runs import Run, read_model_runs, run_of

__all__ = ["ModelComparison", "Run", "compare", "identify_runs", "read_model_runs", "run_of"]
