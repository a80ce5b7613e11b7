"""Rows with the times of the logger instead of the measurement."""

from __future__ import annotations

from typing import ClassVar

from estimation.gate.check import Check
from estimation.gate.context import Context, Stage
from estimation.gate.finding import Finding
from estimation.gate.measurements.late_rows import Rounding, Stalls

# Share of rows that are late, above which it is a warning.
FEW = 1e-4


class LateRows(Check):
    """Reports rows that were written late, and rounded times."""

    name: ClassVar[str] = "late_rows"
    stage: ClassVar[Stage] = Stage.RECORDED
    order: ClassVar[int] = 30

    def run(self, context: Context) -> list[Finding]:
        """Says what was corrected."""
        times = context.recorded.times
        if times.rounding is not None:
            return [_rounded(times.rounding)]
        if times.stalls is not None:
            return [_late(times.stalls, len(times.lost), len(times.t))]
        return []


def _rounded(rounding: Rounding) -> Finding:
    return Finding(
        name="rounded_times",
        severity="info",
        text=f"times are rounded to {1e3 * rounding.resolution:.3g} ms; the sample period is "
        f"{1e3 * rounding.period:.4g} ms",
        action="rows are moved to uniform times; log the time with more digits",
        value=1e3 * rounding.resolution,
        unit="ms",
        column="t",
    )


def _late(stalls: Stalls, lost: int, rows: int) -> Finding:
    done = [f"{stalls.moved} are moved to uniform times"] if stalls.moved else []
    done += [f"{lost} are ignored because others are missing"] if lost else []
    return Finding(
        name="late_rows",
        severity="warning" if stalls.moved + lost > FEW * rows else "info",
        text=f"the logger stopped {f'{stalls.count} times' if stalls.count > 1 else 'once'}, for up to "
        f"{stalls.longest:.3g} s, and then wrote the delayed rows with late time stamps",
        action=f"of these rows, {' and '.join(done)}; let the controller write the time stamps",
        value=float(stalls.moved + lost),
        unit="rows",
        column="t",
        row=stalls.first + 1,
    )
