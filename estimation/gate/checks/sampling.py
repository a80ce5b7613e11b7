"""Sampling: rate, gaps and jitter."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from estimation.gate.check import Check
from estimation.gate.context import Context, Stage
from estimation.gate.finding import Finding
from estimation.gate.measurements.timing import FEWEST, Timing

# From this period on [s], the samples do not show the accelerations of a robot arm.
SLOWEST = 0.5
# Standard deviation of the time steps over the median step, from which jitter is reported.
JITTER = 0.05
# Share of rows in too short parts from which the log is refused.
LOST = 0.5


class Sampling(Check):
    """Finds a sample period in another unit or too long, gaps, and uneven time steps."""

    name: ClassVar[str] = "sampling"
    stage: ClassVar[Stage] = Stage.RECORDED
    order: ClassVar[int] = 20

    def run(self, context: Context) -> list[Finding]:
        """Looks at the time steps."""
        timing = context.recorded.timing
        if not len(timing.steps):
            return []
        return [
            *_rate(timing.period, context.robot.period),
            *_gaps(timing, len(context.recorded.log)),
            *_jitter(timing),
        ]


def _rate(period: float, controller_period: float) -> list[Finding]:
    if period < SLOWEST:
        return []
    units = {1e3: "milliseconds", 1e6: "microseconds", 1e9: "nanoseconds"}
    ratio = period / controller_period
    factor = min(units, key=lambda unit: abs(np.log(ratio / unit)))
    # Controllers sample at 20 Hz to 2 kHz: within a factor of ten of the robot's own period.
    likely = abs(np.log10(ratio / factor)) < 1.0
    return [
        Finding(
            name="unit_of_time" if likely else "rate",
            severity="refuse",
            text=f"the median time step is {period:.4g} s"
            + (
                f": the time seems to be in {units[factor]}"
                if likely
                else ", which is too slow to compute accelerations"
            ),
            action=f"set the unit of t ({units[factor]}) in the file's head or in a mapping (--mapping)"
            if likely
            else "record at 50 Hz or more",
            value=period,
            unit="s",
            column="t",
        )
    ]


def _gaps(timing: Timing, rows: int) -> list[Finding]:
    steps, gaps = timing.steps, timing.gaps
    if not len(gaps):
        return []
    longest = int(gaps[np.argmax(steps[gaps])])
    lost = sum(stop - first for first, stop in timing.parts if stop - first < FEWEST)
    share = lost / rows
    return [
        Finding(
            name="gap",
            severity="refuse" if share > LOST else "warning",
            text=f"{len(gaps)} gap{'s' if len(gaps) > 1 else ''} in time, the longest of {steps[longest]:.4g} s",
            action="the log is split there"
            + (f"; stretches below {FEWEST} rows are left out ({100 * share:.3g} % of the rows)" if lost else ""),
            value=float(steps[longest]),
            unit="s",
            column="t",
            row=longest + 2,
        )
    ]


def _jitter(timing: Timing) -> list[Finding]:
    even = np.delete(timing.steps, timing.gaps)
    jitter = float(even.std() / timing.period) if len(even) else 0.0
    if not jitter > JITTER:
        return []
    return [
        Finding(
            name="jitter",
            severity="info",
            text=f"time steps vary by {100 * jitter:.3g} % of the median ({1e3 * timing.period:.4g} ms), "
            f"from {1e3 * even.min():.3g} to {1e3 * even.max():.3g} ms",
            action="positions are resampled to a uniform grid; torques keep their times",
            value=100 * jitter,
            unit="%",
            column="t",
        )
    ]
