"""Logs that are too short: to compute derivatives, to fit and validate a model, or for the number of parameters."""

from __future__ import annotations

from typing import ClassVar

from estimation.gate.check import Check
from estimation.gate.context import Context, Stage
from estimation.gate.finding import Finding
from estimation.gate.measurements.motion import HARDLY, travel_shares
from estimation.gate.measurements.timing import FEWEST

# Parameters of a joint: ten of its link, and rotor inertia, Coulomb and viscous friction, and offset.
PER_JOINT = 14
# Rows per parameter below which standard errors are unreliable.
ROWS_PER_PARAMETER = 10


class TooFewRows(Check):
    """Refuses a log with too few rows for derivatives."""

    name: ClassVar[str] = "too_few_rows"
    stage: ClassVar[Stage] = Stage.RECORDED
    order: ClassVar[int] = 10

    def run(self, context: Context) -> list[Finding]:
        """Compares the number of rows with the fewest."""
        rows = len(context.recorded.log)
        if rows >= FEWEST:
            return []
        return [
            Finding(
                name="short",
                severity="refuse",
                text=f"{rows} rows",
                action=f"record a longer log: at least {FEWEST} rows are needed",
                value=float(rows),
                unit="rows",
            )
        ]


class TooFewSmoothedRows(Check):
    """Refuses a log with torque and motion whose smoothed parts are too short for a fit."""

    name: ClassVar[str] = "too_few_smoothed_rows"
    stage: ClassVar[Stage] = Stage.SMOOTHED
    order: ClassVar[int] = 40

    def run(self, context: Context) -> list[Finding]:
        """Looks whether any rows are left for a fit."""
        cleaned = context.cleaned
        can_be_fitted = context.smoothed.rows is not None
        if can_be_fitted or not (cleaned.columns.varies.any() and cleaned.columns.travel.any()):
            return []
        if (travel_shares(context.robot, cleaned.columns) < HARDLY).all():
            return [
                Finding(
                    name="no_motion",
                    severity="refuse",
                    text=f"no joint moves by {100 * HARDLY:g} % of its range: nothing to fit a model to",
                    action="record a log in which the arm moves",
                    value=float(cleaned.columns.travel.max()),
                    unit="rad or m",
                )
            ]
        longest = max(stop - first for first, stop in cleaned.timing.parts)
        return [
            Finding(
                name="short",
                severity="refuse",
                text=f"{len(cleaned.log)} rows, {longest} of them without a gap: too few to fit and validate a model",
                action="record a longer log, without gaps",
                value=float(longest),
                unit="rows",
            )
        ]


class FewRowsPerParameter(Check):
    """Warns of a log with few rows for the number of parameters."""

    name: ClassVar[str] = "few_rows_per_parameter"
    stage: ClassVar[Stage] = Stage.FITTED
    order: ClassVar[int] = 10

    def run(self, context: Context) -> list[Finding]:
        """Compares the number of rows with that of the parameters."""
        log = context.cleaned.log
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
