"""Sampling: rate, jitter, gaps, and rows that say nothing new."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from estimation.gate.columns import Columns
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
# Share of rows that repeat the row before while the arm moves, worth a warning.
REPEATED = 0.02
# A column jumps with a step of so many times its hundredth-largest.
JUMP = 3.0
# The jump is one, too, beyond this times the largest step in so many rows on either side.
STRAY, BESIDE = 10.0, 20


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
                action="positions are put on an even grid, torques stay where they are",
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
            text=f"a median step of {period:.4g} s"
            + (f": the time seems to be in {units[factor]}" if likely else ": too slow for accelerations"),
            action=f"state the unit of t ({units[factor]}), in the file's head or in a mapping"
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
            action="the log is cut there, and nothing is interpolated across"
            + (f"; stretches below {FEWEST} rows are left out ({100 * share:.3g} % of the rows)" if lost else ""),
            value=float(steps[longest]),
            unit="s",
            column="t",
            row=longest + 2,
        )
    ]


def check_repeats(log: Log, columns: Columns) -> list[Finding]:
    """Counts rows that repeat the row before in every column although the arm moves, and columns that got stuck.

    Args:
        log: the log.
        columns: of the log.
    """
    if len(log) < FEWEST:
        return []
    same = np.ones(len(log) - 1, dtype=bool)
    for values in (*columns.q, *(() if columns.signal is None else columns.signal)):
        same &= values[1:] == values[:-1]
    findings = []
    moving = _moving(log, columns)[1:]
    repeated = same & moving
    share = float(repeated.sum() / max(int(moving.sum()), 1))
    if repeated.any() and share > 1e-3:
        first = int(np.argmax(repeated))
        findings.append(
            Finding(
                name="repeated_rows",
                severity="warning" if share > REPEATED else "info",
                text=f"{100 * share:.3g} % of the rows repeat the row before while the arm moves",
                action="repeated positions are left out of the smoothing; "
                "have the logger write each message once if there are many",
                value=100 * share,
                unit="%",
                row=first + 2,
            )
        )
    findings += _stuck(columns, moving)
    return findings


def _moving(log: Log, columns: Columns) -> NDArray[np.bool_]:
    """Where the arm moves (N,): within a twentieth of a second either way some joint changes."""
    half = max(2, round(0.05 * (len(log) - 1) / max(log.duration, 1e-300)))
    half = min(half, (len(log) - 1) // 2)
    moving = np.zeros(len(log) - 2 * half, dtype=bool)
    for q, travel in zip(columns.q, columns.travel, strict=True):
        if travel > 0:
            moving |= np.abs(q[2 * half :] - q[: -2 * half]) > 1e-3 * travel
    edge = np.zeros(half, dtype=bool)
    return np.concatenate([edge, moving, edge])


def _stuck(columns: Columns, moving: NDArray[np.bool_]) -> list[Finding]:
    """Columns that hold one value while the arm moves, and then jump: a sensor or a bus that hung.

    A joint that stands holds its value too, but does not jump when it starts.
    """
    findings = []
    for prefix, values in (("q", columns.q), (columns.prefix, columns.signal)):
        for joint, column in enumerate(() if values is None else values):
            steps = np.abs(np.diff(column))
            held = steps == 0
            share = float(held.mean())
            if share > 0.5 or not held.any():
                continue  # coarse or standing: other checks speak of it
            # With a share p of equal neighbours, N rows hold a run of log(N) / log(1/p) by chance; thrice that is not.
            chance = np.log(len(column)) / np.log(1.0 / max(share, 1.0 / len(column)))
            usual = JUMP * float(np.quantile(steps[:: max(1, len(steps) // 50_000)], 0.99))
            # What hung may have stood for a part of that: rows in which the arm moves count.
            starts, stops = ends(held)
            passed = np.concatenate([[0], np.cumsum(moving)])
            long = passed[stops] - passed[starts] >= max(3.0 * chance, FEWEST)
            hung = [
                (int(stop - start), int(start))
                for start, stop in zip(starts[long], stops[long], strict=True)
                # A torque may be that of a brake, until it is let go.
                if _step(steps, stop) > (min(usual, _about(steps, start, stop)) if prefix == "q" else usual)
            ]
            if not hung:
                continue
            length, start = max(hung)
            findings.append(
                Finding(
                    name="stuck",
                    severity="warning",
                    text=f"holds one value for {length + 1} rows while the arm moves, and jumps then",
                    action="the log is cut there; repair the logger",
                    value=float(length + 1),
                    unit="rows",
                    column=f"{prefix}{joint + 1}",
                    joint=joint + 1,
                    row=start + 1,
                )
            )
    return findings


def without_hung(parts: Sequence[tuple[int, int]], findings: Sequence[Finding]) -> tuple[tuple[int, int], ...]:
    """Cuts stretches (first, stop) where a column hung: its rows there are not of that time."""
    rest = list(parts)
    for finding in findings:
        if finding.name != "stuck" or finding.row is None:
            continue
        first, stop = finding.row, finding.row + int(finding.value) - 1
        pieces = [piece for a, b in rest for piece in ((a, min(b, first)), (max(a, stop), b))]
        rest = [(a, b) for a, b in pieces if a < b]
    return tuple(rest)


def _step(steps: Array, row: int) -> float:
    return float(steps[row]) if row < len(steps) else 0.0


def _about(steps: Array, start: int, stop: int) -> float:
    """The size of a step after a run of rows that no motion beside that run comes near; infinite where nothing moves.

    A slow joint that goes on as slowly as it came has jumped, however fast it is elsewhere.
    """
    beside = np.concatenate([steps[max(start - BESIDE, 0) : start], steps[stop + 1 : stop + 1 + BESIDE]])
    most = float(beside.max(initial=0.0))
    return STRAY * most if most > 0 else np.inf


def longest_run(flags: NDArray[np.bool_]) -> tuple[int, int]:
    """Finds the longest run of True: its start and its length, (0, 0) without any."""
    starts, stops = ends(flags)
    if not len(starts):
        return 0, 0
    best = int(np.argmax(stops - starts))
    return int(starts[best]), int(stops[best] - starts[best])
