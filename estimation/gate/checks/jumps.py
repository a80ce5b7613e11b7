"""Jumps of positions: a reset encoder, an angle that wraps, or overwritten rows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from estimation.gate.columns import Columns
from estimation.gate.finding import Finding
from robots.common.stretches import spans

Array = NDArray[np.float64]

# A step is a jump when it exceeds its hundredth-largest by so much, this share of the travel, ...
OUT, SHARE = 3.0, 0.005
# ... and all other steps so many rows either way by so much: messages that come twice make steps of up to four.
WINDOW, LOCAL = 10, 5.0
# So many in a row at most: a value between the old and the new one is usual.
AT_ONCE = 2
# Share of the travel from which on a fit would be wrong.
MUCH = 0.05


def jump_rows(t: Array, q: Array) -> NDArray[np.intp]:
    """Finds the rows of a position (N,) before which it jumps, as no joint can: at one sample, and not around it.

    Args:
        t: time (N,) [s]; a message that was lost makes a longer step, and no jump.
        q: position (N,).
    """
    duration = np.diff(t)
    steps = np.abs(np.diff(q)) / np.maximum(duration / np.median(duration), 1.0)
    usual = float(np.quantile(steps[:: max(1, len(steps) // 20_000)], 0.99))
    large = steps > max(OUT * usual, SHARE * float(q.max() - q.min()))
    if not large.any() or large.mean() > 0.01:
        return np.empty(0, dtype=np.intp)
    # A joint that mostly stands has large steps one after the other when it goes: so it gathered speed.
    for start, stop in spans(large):
        large[start:stop] = stop - start <= AT_ONCE
    around = maximum_filter1d(np.where(large, 0.0, steps), 2 * WINDOW + 1)
    return np.flatnonzero(large & (steps > LOCAL * around)) + 1


def check_jumps(
    t: Array, columns: Columns, spikes: NDArray[np.intp], gaps: NDArray[np.intp], stands: NDArray[np.bool_]
) -> list[Finding]:
    """Finds jumps of positions that are neither single rows nor beside a gap in time.

    Args:
        t: time (N,) [s].
        columns: of the log.
        spikes: rows with outliers, which are ignored anyway.
        gaps: rows after a gap.
        stands: joints (n,) that stand: they tremble by steps of the encoder, one sample each.
    """
    known = np.concatenate([spikes, spikes + 1, gaps])
    findings = []
    for joint, q in enumerate(columns.q):
        rows = jump_rows(t, q) if not stands[joint] else np.empty(0, dtype=np.intp)
        rows = rows[~np.isin(rows, known)]
        if not len(rows):
            continue
        sizes = q[rows] - q[rows - 1]
        worst = int(np.argmax(np.abs(sizes)))
        wraps = abs(abs(sizes[worst]) - 2 * np.pi) < 0.1
        findings.append(
            Finding(
                name="jump",
                severity="refuse" if abs(sizes[worst]) > MUCH * columns.travel[joint] else "warning",
                text=f"jumps {len(rows)} time{'s' if len(rows) > 1 else ''}, by up to {sizes[worst]:.4g} in one sample"
                + (": the angle wraps" if wraps else ""),
                action="unwrap the angle" if wraps else "cut the log there, and check the encoder and the logger",
                value=float(sizes[worst]),
                unit="rad or m",
                column=f"q{joint + 1}",
                joint=joint + 1,
                row=int(rows[worst]) + 1,
            )
        )
    return findings
