"""Findings of one kind in a report."""

from __future__ import annotations

from estimation.gate import GateReport
from estimation.gate.finding import Finding


def found(report: GateReport, name: str) -> list[Finding]:
    """Gives the findings of one name."""
    return [finding for finding in report.findings if finding.name == name]


def joints(report: GateReport, name: str) -> list[int | None]:
    """Gives the joints of the findings of one name."""
    return [finding.joint for finding in found(report, name)]
