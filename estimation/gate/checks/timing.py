"""Sampling: rate, jitter and gaps."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from estimation.gate.finding import Finding
from estimation.gate.report import FEWEST
from robots.common.stretches import ends
from robots.signals import Log

Array = NDArray[np.float64]

# A step of so many median steps is a gap, where it is long enough for the arm to have changed its mind as well ...
GAP_STEPS = 8.0
# ... in seconds: a network that hiccups for a few hundredths of a second is bridged without harm.
GAP_TIME = 0.1
# Slower than this [s], no acceleration of a robot arm is left in the samples.
SLOWEST = 0.5
# Jitter of the time stamps (standard deviation over the median step) worth a word.
JITTER = 0.05


@dataclass(frozen=True)
class Timing:
    """The clock of a log.

    Attributes:
        period: median step [s].
        parts: (first, stop) of the stretches between gaps.
        findings: what is wrong with it.
    """

    period: float
    parts: tuple[tuple[int, int], ...]
    findings: tuple[Finding, ...]


def check_timing(log: Log, controller_period: float) -> Timing:
    """Looks at the steps of time.

    Args:
        log: the log.
        controller_period: sample period of the robot's controller [s], to recognise milliseconds.
    """
    steps = np.diff(log.t)
    if not len(steps):
        return Timing(np.nan, ((0, len(log)),), ())
    period = float(np.median(steps))
    gaps = np.flatnonzero((steps > GAP_STEPS * period) & (steps > GAP_TIME))
    edges = np.concatenate([[0], gaps + 1, [len(log)]])
    parts = tuple((int(first), int(stop)) for first, stop in pairwise(edges))
    findings = [*_rate(period, controller_period, log), *_gaps(log, steps, gaps, parts)]
    even = np.delete(steps, gaps)
    jitter = float(even.std() / period) if len(even) else 0.0
    if jitter > JITTER:
        findings.append(
            Finding(
                name="jitter",
                severity="info",
                text=f"time steps vary by {100 * jitter:.3g} % of the median ({1e3 * period:.4g} ms), "
                f"from {1e3 * even.min():.3g} to {1e3 * even.max():.3g} ms",
                action="positions are resampled to a uniform grid; torques keep their times",
                value=100 * jitter,
                unit="%",
                column="t",
            )
        )
    return Timing(period, parts, tuple(findings))


def _rate(period: float, controller_period: float, log: Log) -> list[Finding]:
    if period < SLOWEST:
        return []
    units = {1e3: "milliseconds", 1e6: "microseconds", 1e9: "nanoseconds"}
    ratio = period / controller_period
    factor = min(units, key=lambda unit: abs(np.log(ratio / unit)))
    # Controllers sample between 2 kHz and 20 Hz: a decade around the robot's own period.
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


def _gaps(log: Log, steps: Array, gaps: NDArray[np.intp], parts: tuple[tuple[int, int], ...]) -> list[Finding]:
    if not len(gaps):
        return []
    longest = int(gaps[np.argmax(steps[gaps])])
    lost = sum(stop - first for first, stop in parts if stop - first < FEWEST)
    share = lost / len(log)
    return [
        Finding(
            name="gap",
            severity="refuse" if share > 0.5 else "warning",
            text=f"{len(gaps)} gap{'s' if len(gaps) > 1 else ''} in time, the longest of {steps[longest]:.4g} s",
            action="the log is split there"
            + (f"; stretches below {FEWEST} rows are left out ({100 * share:.3g} % of the rows)" if lost else ""),
            value=float(steps[longest]),
            unit="s",
            column="t",
            row=longest + 2,
        )
    ]


def longest_run(flags: NDArray[np.bool_]) -> tuple[int, int]:
    """Finds the longest run of True: its start and its length, (0, 0) without any."""
    starts, stops = ends(flags)
    if not len(starts):
        return 0, 0
    best = int(np.argmax(stops - starts))
    return int(starts[best]), int(stops[best] - starts[best])
