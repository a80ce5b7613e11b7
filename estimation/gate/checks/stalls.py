"""Rows that a logger wrote late: it stalled, and then wrote in a rush what had come meanwhile."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.gate.finding import Finding
from estimation.gate.report import FEWEST
from robots.signals import Log

Array = NDArray[np.float64]

# A step of more median steps than the first, up to so long [s], is a stall where steps below the second follow it.
STALL, LONGEST, RUSH = 1.6, 2.0, 0.9
# Share of rows that are late, worth a warning; and of a step that times may be off.
FEW, FINE = 1e-4, 0.05
# Steps that are multiples of one by this are rounded to that.
WHOLE = 0.01
# What came during a stall has all been written where its rows fill the time to within this share of a step.
FILLED = 0.5


@dataclass(frozen=True, eq=False)
class Stalls:
    """Effects of a stalled logger on a log.

    Attributes:
        findings: none where it did not.
        t: times (N,) [s] at which the rows were measured, as far as they can be reconstructed.
        lost: rows whose times cannot be reconstructed.
    """

    findings: tuple[Finding, ...]
    t: Array
    lost: NDArray[np.intp]


def check_stalls(log: Log) -> Stalls:
    """Looks for rows that follow each other faster than they were measured, after a step that is too long.

    Messages that wait in a queue are stamped when they are read. Where they are as many as the time has room for, they
    are put evenly into it; where some were lost, nobody knows which. A logger that measures anew to catch up has its
    positions right at the times it tells: then nothing is done. Nor are times what they say that are rounded to more
    than a part of a step.

    Args:
        log: the log.
    """
    none = np.zeros(0, dtype=np.intp)
    steps = np.diff(log.t)
    if len(log) < FEWEST:
        return Stalls((), log.t, none)
    period = float(np.median(steps))
    if (rounded := _rounded(log, period)) is not None:
        return rounded
    even, lost, begins = log.t.copy(), [none], []
    for begin in np.flatnonzero((steps > STALL * period) & (steps < LONGEST)).tolist():
        end = begin + 1
        while end < len(steps) and steps[end] < RUSH * period:
            end += 1
        if end == begin + 1:
            continue  # rows that are missing
        begins.append(begin)
        if abs(log.t[end] - log.t[begin] - (end - begin) * period) < FILLED * period:
            even[begin + 1 : end + 1] = log.t[begin] + period * np.arange(1, end - begin + 1)
        else:
            lost.append(np.arange(begin + 1, end))
    late, left_out = np.flatnonzero(even != log.t), np.concatenate(lost)
    if not _fits(log, even, late):
        even, late = log.t, none
    if not len(late) + len(left_out):
        return Stalls((), log.t, none)
    done = [f"{len(late)} are moved to uniform times"] if len(late) else []
    done += [f"{len(left_out)} are ignored because others are missing"] if len(left_out) else []
    finding = Finding(
        name="late_rows",
        severity="warning" if len(late) + len(left_out) > FEW * len(log) else "info",
        text=f"the logger stopped {f'{len(begins)} times' if len(begins) > 1 else 'once'}, for up to "
        f"{steps[begins].max():.3g} s, and then wrote the delayed rows with late time stamps",
        action=f"of these rows, {' and '.join(done)}; let the controller write the time stamps",
        value=float(len(late) + len(left_out)),
        unit="rows",
        column="t",
        row=begins[0] + 2,
    )
    return Stalls((finding,), even, left_out)


def _rounded(log: Log, period: float) -> Stalls | None:
    """Gives uniform times if the logged ones are these, rounded; None otherwise."""
    steps = np.diff(log.t)
    resolution = float(steps.min())
    if np.abs(steps / resolution - np.round(steps / resolution)).max() > WHOLE:
        return None
    rows = np.arange(len(log))
    even = np.polynomial.Polynomial.fit(rows, log.t, 1)(rows)
    off = float(np.abs(log.t - even).max())
    # Whole steps are uniform already, and rounding to a small fraction of a step does no harm.
    if not FINE * period < off <= resolution or not _fits(log, even, rows[1::2]):
        return None
    step = float(even[1] - even[0])
    finding = Finding(
        name="rounded_times",
        severity="info",
        text=f"times are rounded to {1e3 * resolution:.3g} ms; the sample period is {1e3 * step:.4g} ms",
        action="rows are moved to uniform times; log the time with more digits",
        value=1e3 * resolution,
        unit="ms",
        column="t",
    )
    return Stalls((finding,), even, np.zeros(0, dtype=np.intp))


def _fits(log: Log, even: Array, late: NDArray[np.intp]) -> bool:
    """Whether positions in some rows lie between those of the others in even times, rather than in times as logged."""
    if not len(late):
        return False
    known = np.setdiff1d(np.arange(len(log)), late)
    size = np.abs(np.diff(log.q, axis=0)).mean(axis=0)
    off = [
        np.abs(log.q[late] - np.column_stack([np.interp(t[late], t[known], q) for q in log.q[known].T]))
        for t in (even, log.t)
    ]
    shares = [float((error[:, size > 0] / size[size > 0]).sum()) for error in off]
    return shares[0] < shares[1]
