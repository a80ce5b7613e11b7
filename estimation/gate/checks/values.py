"""Findings that a look at the values gives: too few, constant, or none that a joint can have."""

from __future__ import annotations

import numpy as np

from estimation.gate.checks.timing import Timing
from estimation.gate.columns import Columns
from estimation.gate.finding import Finding
from estimation.gate.report import FEWEST
from robots.signals import Log

# Values beyond these are impossible for a position or a torque in any unit.
ABSURD_Q, ABSURD_TAU = 1e6, 1e8
# Parameters of a joint and its link, and rows that each of them deserves.
PER_JOINT, ROWS_PER_PARAMETER = 14, 10
# Number of rows that distinguishes most columns.
LOOKED_AT = 50


def too_little(log: Log, timing: Timing) -> Finding:
    """Refuses a log that is too short after smoothing."""
    longest = max(stop - first for first, stop in timing.parts)
    return Finding(
        name="short",
        severity="refuse",
        text=f"{len(log)} rows, {longest} of them without a gap: too few to fit and validate a model",
        action="record a longer log, without gaps",
        value=float(longest),
        unit="rows",
    )


def few_rows(log: Log) -> list[Finding]:
    """Tells a log whose rows are few against the parameters: ten of each link and four of each joint."""
    parameters = PER_JOINT * log.n
    if len(log) >= ROWS_PER_PARAMETER * parameters:
        return []
    return [
        Finding(
            name="short",
            severity="warning",
            text=f"{len(log)} rows ({log.duration:.3g} s) for some {parameters} parameters",
            action="record a longer log: standard errors from so few rows are unreliable",
            value=float(len(log)),
            unit="rows",
        )
    ]


def absurd_values(columns: Columns) -> list[Finding]:
    """Values that no joint has, in any unit."""
    findings = []
    for prefix, values, most in (("q", columns.q, ABSURD_Q), (columns.prefix, columns.signal, ABSURD_TAU)):
        for joint, column in enumerate(() if values is None else values, start=1):
            row = int(np.argmax(np.abs(column)))
            if abs(column[row]) > most:
                findings.append(
                    Finding(
                        name="absurd_value",
                        severity="refuse",
                        text=f"reaches {column[row]:.4g}",
                        action="repair or remove these rows",
                        value=float(column[row]),
                        column=f"{prefix}{joint}",
                        joint=joint,
                        row=row + 1,
                    )
                )
    return findings


def same_columns(columns: Columns) -> list[Finding]:
    """Tells a column that has the values of another in every row: two joints are never so alike, a copy is."""
    known = [(f"q{j}", column) for j, column in enumerate(columns.q, start=1)]
    if columns.signal is not None:
        known += [(f"{columns.prefix}{j}", column) for j, column in enumerate(columns.signal, start=1)]
    moving = [(name, column) for name, column in known if column.min() < column.max()]
    findings = []
    for i, (name, column) in enumerate(moving):
        step = max(1, len(column) // LOOKED_AT)
        twin = next(
            (
                other
                for other, values in moving[:i]
                if np.array_equal(values[::step], column[::step]) and np.array_equal(values, column)
            ),
            None,
        )
        if twin is not None:
            findings.append(
                Finding(
                    name="same_column",
                    severity="warning",
                    text=f"is identical to {twin} in every row",
                    action="one column was copied; the parameters of both joints are unreliable",
                    value=float(len(column)),
                    unit="rows",
                    column=name,
                    joint=int(name.lstrip("qtaui")),
                )
            )
    return findings


def too_short(log: Log) -> list[Finding]:
    """Refuses a log of fewer rows than any fit needs."""
    if len(log) >= FEWEST:
        return []
    return [
        Finding(
            name="short",
            severity="refuse",
            text=f"{len(log)} rows",
            action=f"record a longer log: at least {FEWEST} rows are needed",
            value=float(len(log)),
            unit="rows",
        )
    ]


def constant_torques(columns: Columns) -> list[Finding]:
    """Finds torques or currents that never change."""
    if columns.signal is None:
        return []
    return [
        Finding(
            name="constant_torque",
            severity="warning" if columns.varies.any() else "refuse",
            text=f"has the constant value {columns.signal[joint, 0]:.4g}",
            action="record the torque of the moving arm, and check the meaning of the column",
            value=float(columns.signal[joint, 0]),
            unit="A" if columns.prefix == "i" else "N m or N",
            column=f"{columns.prefix}{joint + 1}",
            joint=int(joint) + 1,
        )
        for joint in np.flatnonzero(~columns.varies)
    ]


def notes_of_reader(log: Log) -> list[Finding]:
    """Changes that the reader made."""
    return [
        Finding(
            name=str(note["name"]),
            severity="info",
            text=str(note["text"]),
            action=str(note["action"]),
            value=float(note["value"]),
            unit="rows",
        )
        for note in log.metadata.get("repairs", ())
    ]


def once(findings: list[Finding]) -> list[Finding]:
    """The first finding of a kind about the whole log; two checks may come to the same unit."""
    seen: set[tuple[str, int | None]] = set()
    kept = []
    for finding in findings:
        key = (
            finding.name,
            None if finding.severity == "refuse" and finding.name.startswith("unit") else finding.joint,
        )
        if finding.name.startswith(("unit_of_time", "unit_of_position", "motor")):
            if key in seen:
                continue
            seen.add(key)
        kept.append(finding)
    return kept
