"""Identified models against each other: which differences are real, drift over runs, and a merged estimate."""

from estimation.comparisons.comparing import compare
from estimation.comparisons.drive_comparison import DriveComparison, compare_drives, read_drive_runs
from estimation.comparisons.log_runs import identify_runs
from estimation.comparisons.result import ModelComparison
from estimation.comparisons.runs import Run, read_model_runs, run_of

__all__ = [
    "DriveComparison",
    "ModelComparison",
    "Run",
    "compare",
    "compare_drives",
    "identify_runs",
    "read_drive_runs",
    "read_model_runs",
    "run_of",
]
