"""Checks of a log before any fit: its faults, their severity, and what to do."""

from estimation.gate.finding import Finding
from estimation.gate.gate import check_log
from estimation.gate.report import GateReport

__all__ = ["Finding", "GateReport", "check_log"]
