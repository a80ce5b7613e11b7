"""Checks of a log before any fit: its faults, their severity, and what to do."""

from estimation.gate.check import Check
from estimation.gate.checks import CHECKS
from estimation.gate.context import Context, Stage
from estimation.gate.finding import Finding
from estimation.gate.gate import check_log
from estimation.gate.log_sets import check_logs
from estimation.gate.report import GateReport

__all__ = ["CHECKS", "Check", "Context", "Finding", "GateReport", "Stage", "check_log", "check_logs"]
