"""The gate before any fit: what is wrong with a log, how badly, and what to do about it."""

from estimation.gate.finding import Finding
from estimation.gate.gate import check_log
from estimation.gate.report import GateReport

__all__ = ["Finding", "GateReport", "check_log"]
