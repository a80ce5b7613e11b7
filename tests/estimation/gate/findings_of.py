"""What a report of the gate holds of one kind."""

from __future__ import annotations

from estimation.gate import GateReport
from estimation.gate.finding import Finding


def found(report: GateReport, name: str) -> list[Finding]:
    """Those of one name."""
    return [finding for finding in report.findings if finding.name == name]


def joints(report: GateReport, name: str) -> list[int | None]:
    """Their joints."""
    return [finding.joint for finding in found(report, name)]
