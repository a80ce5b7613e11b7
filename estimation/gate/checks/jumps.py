"""Jumps of positions: a reset encoder, or overwritten rows."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from estimation.gate.check import Check
from estimation.gate.context import Context, Stage
from estimation.gate.finding import Finding
from robots.common.plain import several
from robots.common.stretches import spans

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

# A step is a jump above so many times the 99th percentile of the steps and this share of the travel, ...
LARGE_STEP, LEAST_TRAVEL = 3.0, 0.005
# ... and above so many times all other steps within so many rows: messages that come twice make steps of up to four.
LARGE_BESIDE, WINDOW = 5.0, 10
# Most rows of one jump: one row may lie between the old value and the new one.
ROWS_OF_A_JUMP = 2
# Share of large steps above which they are the motion.
COMMON = 0.01
# Number of steps from which the percentile is estimated.
SAMPLES = 20_000
# Share of the travel above which a jump would make a fit wrong.
REFUSED_TRAVEL = 0.05


class Jumps(Check):
    """Finds jumps of positions that are neither outliers of single rows nor beside a gap in time."""

    name: ClassVar[str] = "jumps"
    stage: ClassVar[Stage] = Stage.RECORDED
    order: ClassVar[int] = 130

    def run(self, context: Context) -> list[Finding]:
        """Reports the number of jumps and the largest of each joint."""
        recorded = context.recorded
        known = np.concatenate([recorded.spikes, recorded.spikes + 1, recorded.timing.gaps + 1])
        # A lost message makes a longer step, and no jump.
        periods = np.maximum(recorded.timing.steps / recorded.timing.period, 1.0)
        findings = []
        for joint, q in enumerate(recorded.columns.q):
            # The position of a joint that stands changes by single encoder steps.
            if recorded.standing[joint]:
                continue
            rows = np.setdiff1d(jump_rows(periods, q), known)
            if len(rows):
                findings.append(_finding(joint, q, rows, float(recorded.columns.travel[joint])))
        return findings


def jump_rows(periods: Array, q: Array) -> Rows:
    """Finds the rows of a position (N,) before which it jumps: by one large step, without large ones around it.

    Args:
        periods: time steps (N - 1,) over their median, 1 at least.
        q: position (N,).
    """
    steps = np.abs(np.diff(q)) / periods
    usual = float(np.quantile(steps[:: max(1, len(steps) // SAMPLES)], 0.99))
    large = steps > max(LARGE_STEP * usual, LEAST_TRAVEL * float(q.max() - q.min()))
    if not large.any() or large.mean() > COMMON:
        return np.empty(0, dtype=np.intp)
    # A joint that stands for most of the log makes many large steps in a row when it accelerates.
    for start, stop in spans(large):
        large[start:stop] = stop - start <= ROWS_OF_A_JUMP
    around = maximum_filter1d(np.where(large, 0.0, steps), 2 * WINDOW + 1)
    return np.flatnonzero(large & (steps > LARGE_BESIDE * around)) + 1


def _finding(joint: int, q: Array, rows: Rows, travel: float) -> Finding:
    sizes = q[rows] - q[rows - 1]
    largest = int(np.argmax(np.abs(sizes)))
    return Finding(
        name="jump",
        severity="refuse" if abs(sizes[largest]) > REFUSED_TRAVEL * travel else "warning",
        text=f"jumps {several(len(rows), 'time')}, by up to {sizes[largest]:.4g} in one sample",
        action="cut the log there, and check the encoder and the logger",
        value=float(sizes[largest]),
        unit="rad or m",
        column=f"q{joint + 1}",
        joint=joint + 1,
        row=int(rows[largest]) + 1,
    )
