"""Answers of a tool: their form, and how they are read and written."""

from oed.benchmarks.answers.answer import Answers, CaseAnswer, NamedEffect, StatedValue
from oed.benchmarks.answers.files import read_answers, write_answers

__all__ = ["Answers", "CaseAnswer", "NamedEffect", "StatedValue", "read_answers", "write_answers"]
