"""Rows that say nothing new: those that repeat the row before, and columns that hung."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimation.gate.checks.resolution import lattice_step
from estimation.gate.columns import Columns
from estimation.gate.finding import Finding
from estimation.gate.report import FEWEST
from robots.common.stretches import ends
from robots.signals import Log

Array = NDArray[np.float64]

# Share of rows that repeat the row before while the arm moves, worth a warning.
REPEATED = 0.02
# A joint that moves by so many of its encoder's steps a row shows each row's position. Where so large a share of such
# rows are copies, a logger asks more often than the controller answers; a message that comes twice makes nothing late.
FAST, COPIED = 2.0, 0.1
# A column jumps with a step of so many times its hundredth-largest.
JUMP = 3.0
# The jump is one, too, beyond this times the largest step in so many rows on either side.
STRAY, BESIDE = 10.0, 20


def check_repeats(log: Log, columns: Columns) -> tuple[list[Finding], NDArray[np.intp]]:
    """Counts rows that repeat the row before in every column although the arm moves, and columns that got stuck.

    If there are many that the encoder's resolution does not explain, their rows are returned. A logger that polls
    faster than the controller answers writes old positions and torques with later times.

    Args:
        log: the log.
        columns: of the log.
    """
    none = np.zeros(0, dtype=np.intp)
    if len(log) < FEWEST:
        return [], none
    same = np.ones(len(log) - 1, dtype=bool)
    for values in (*columns.q, *(() if columns.signal is None else columns.signal)):
        same &= values[1:] == values[:-1]
    findings = []
    moving = _moving(log, columns)[1:]
    repeated = same & moving
    share = float(repeated.sum() / max(int(moving.sum()), 1))
    copies = none
    if repeated.any():
        fast = _moving(log, columns, steps=FAST)[1:]
        if float((same & fast).sum()) > COPIED * max(int(fast.sum()), 1):
            copies = np.flatnonzero(repeated) + 1
    if repeated.any() and share > 1e-3:
        first = int(np.argmax(repeated))
        findings.append(
            Finding(
                name="repeated_rows",
                severity="warning" if share > REPEATED else "info",
                text=f"{100 * share:.3g} % of the rows repeat the row before while the arm moves",
                action="these rows are ignored; make the logger write each message once"
                if len(copies)
                else "repeated positions are ignored in the smoothing; make the logger write each message once",
                value=100 * share,
                unit="%",
                row=first + 2,
            )
        )
    findings += _stuck(columns, moving)
    return findings, copies


def _moving(log: Log, columns: Columns, steps: float = 0.0) -> NDArray[np.bool_]:
    """Where the arm moves (N,): within a twentieth of a second either way some joint changes.

    By so many of the encoder's steps a row, where that is asked.
    """
    half = max(2, round(0.05 * (len(log) - 1) / max(log.duration, 1e-300)))
    half = min(half, (len(log) - 1) // 2)
    moving = np.zeros(len(log) - 2 * half, dtype=bool)
    for q, travel in zip(columns.q, columns.travel, strict=True):
        if travel > 0:
            least = max(1e-3 * travel, 2 * half * steps * lattice_step(q) if steps else 0.0)
            moving |= np.abs(q[2 * half :] - q[: -2 * half]) > least
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
            # The arm may have rested for a part of that: only rows in which it moves count.
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
                    text=f"keeps one value for {length + 1} rows while the arm moves, and then jumps",
                    action="the log is split there; repair the logger",
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
