"""Sampling: rate, gaps and jitter."""

from __future__ import annotations

import numpy as np

from estimation.gate.context import Context
from estimation.gate.finding import Finding
from estimation.recordings.rows.timing import FEWEST, ClockSteps, Timing
from robots.common.plain import several
from robots.signals import Log

# From this period on [s], the samples do not show the accelerations of a robot arm.
SLOWEST = 0.5
# A period is that of another column or a unit within this factor.
ALIKE = 1.5
# Correlation of the steps of a position with its velocity column from which the period is known, and the share by which
# the periods of the joints may differ.
LEAST_CORRELATION, SIMILAR = 0.95, 0.1
# Standard deviation of the time steps over the median step, from which jitter is reported.
JITTER = 0.05
# Share of rows in too short parts from which the log is refused.
LOST = 0.5


def sampling(context: Context) -> list[Finding]:
    """Finds a sample period in another unit or too long, gaps, and uneven time steps."""
    timing = context.recorded.timing
    if not len(timing.steps):
        return []
    return [
        *_rate(timing, context.robot.period, _period_by_velocity(context.recorded.log)),
        *_clock_steps(context.recorded.clock_steps),
        *_gaps(timing, len(context.recorded.log)),
        *_jitter(timing),
    ]


# Units of time as a mapping states them.
SHORT = {"milliseconds": "ms", "microseconds": "us", "nanoseconds": "ns"}


def _rate(timing: Timing, controller_period: float, known: float) -> list[Finding]:
    period = timing.period
    if period < SLOWEST:
        return []
    units = {1e3: "milliseconds", 1e6: "microseconds", 1e9: "nanoseconds"}
    ratio = period / (known if np.isfinite(known) else controller_period)
    factor = min(units, key=lambda unit: abs(np.log(ratio / unit)))
    # Controllers sample at 20 Hz to 2 kHz: within a factor of ten of the robot's own period.
    likely = abs(np.log10(ratio / factor)) < (np.log10(ALIKE) if np.isfinite(known) else 1.0)
    counts = period == 1.0 and bool(np.all(timing.steps == np.round(timing.steps)))
    # A controller of 1 kHz also gives steps of one millisecond.
    if counts and not abs(np.log(ratio / 1e3)) < np.log(ALIKE):
        return [_row_counter(known, controller_period)]
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
            action=f"state `time: {{unit: {SHORT[units[factor]]}}}` in a mapping (--mapping)"
            if likely
            else "record at 50 Hz or more",
            value=period,
            unit="s",
            column="t",
        )
    ]


def _row_counter(known: float, controller_period: float) -> Finding:
    by_velocity = f"the velocity columns show {1 / known:.4g} Hz" if np.isfinite(known) else ""
    by_robot = f"the robot's description states {1 / controller_period:.4g} Hz for its controller"
    return Finding(
        name="row_counter",
        severity="refuse",
        text="the column counts rows: it increases by 1 each time, and is no time",
        action=f"state the rate of the logger with --rate ({by_velocity or by_robot}), or log the time; if it is in "
        "milliseconds, set its unit in a mapping (--mapping)",
        value=1.0,
        unit="rows",
        column="t",
    )


def _period_by_velocity(log: Log) -> float:
    """Gives the sample period that velocity columns show, as the positions change by velocity times period [s].

    NaN without velocity columns, or if the joints disagree.
    """
    if log.dq is None or len(log) < FEWEST:
        return np.nan
    moved, mean = np.diff(log.q, axis=0), 0.5 * (log.dq[1:] + log.dq[:-1])
    energy = np.einsum("tj,tj->j", mean, mean)
    size = np.einsum("tj,tj->j", moved, moved)
    moves = (energy > 0) & (size > 0)
    if not moves.any():
        return np.nan
    product = np.einsum("tj,tj->j", moved, mean)[moves]
    alike = product / np.sqrt(energy[moves] * size[moves])
    periods = product / energy[moves]
    periods = periods[alike > LEAST_CORRELATION]
    agree = 2 * len(periods) > len(alike) and float(np.ptp(periods)) < SIMILAR * float(periods.max())
    return float(np.median(periods)) if agree else np.nan


def _clock_steps(found: ClockSteps) -> list[Finding]:
    if not len(found.rows):
        return []
    count, largest = len(found.rows), int(np.argmax(np.abs(found.sizes)))
    size = 1e3 * float(found.sizes[largest])
    return [
        Finding(
            name="clock_step",
            severity="warning",
            text=f"the clock was set {'ahead' if size > 0 else 'back'} {f'{count} times' if count > 1 else 'once'}, by "
            f"{'up to ' if count > 1 else ''}{abs(size):.3g} ms: the arm moved only as far as in one sample period",
            action="the log is split there; do not set the clock while logging",
            value=size,
            unit="ms",
            column="t",
            row=int(found.rows[largest]) + 1,
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
            text=f"{several(len(gaps), 'gap')} in time, the longest of {steps[longest]:.4g} s",
            action="the log is split there"
            + (f"; stretches below {FEWEST} rows are left out ({100 * share:.3g} % of the rows)" if lost else ""),
            value=float(steps[longest]),
            unit="s",
            column="t",
            row=longest + 2,
        )
    ]


def _jitter(timing: Timing) -> list[Finding]:
    even = np.delete(timing.steps, np.union1d(timing.gaps, timing.clock_steps))
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
