"""Torques that accumulate at an extreme value."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from estimation.gate.check import Check
from estimation.gate.context import Context, Stage
from estimation.gate.finding import Finding
from estimation.gate.measurements.columns import Columns
from robots.common.stretches import ends

Array = NDArray[np.float64]

# A torque is clipped at an extreme value if it holds it in a run of so many rows, in so many times the rows of the step
# next to it, ...
CLIPPED_RUN, CLIPPED_PILE = 5, 8.0
# ... and in this share of all rows.
CLIPPED_SHARE = 5e-4
# A step at an extreme value: the resolution of the column, or this share of its range if that is larger.
WIDTH = 1e-6


class Clipping(Check):
    """Finds torques or currents that accumulate at their largest or smallest value.

    A smooth peak is at most some three times as long in its last step as in the one before. A limit holds the torque
    longer. Rows in which the joint stands do not count: a brake holds the torque as well. Torques of exactly zero come
    from a drive that is off, and are reported as such.
    """

    name: ClassVar[str] = "clipping"
    stage: ClassVar[Stage] = Stage.RECORDED
    order: ClassVar[int] = 90

    def run(self, context: Context) -> list[Finding]:
        """Looks at both extreme values of each column."""
        columns = context.recorded.columns
        if columns.signal is None:
            return []
        return [finding for joint in range(len(columns.signal)) for finding in _clipped(columns, joint)]


def _clipped(columns: Columns, joint: int) -> list[Finding]:
    assert columns.signal is not None
    values = columns.signal[joint]
    low, high = float(values.min()), float(values.max())
    if high == low:
        return []
    width = max(float(columns.signal_steps[joint]), WIDTH * (high - low))
    fewest = max(CLIPPED_RUN, CLIPPED_SHARE * len(values))
    share, run, begins, at_limit = 0.0, 0, 0, []
    for extreme, side in ((high, 1.0), (low, -1.0)):
        distance = side * (extreme - values)
        at = distance < 0.5 * width
        if np.count_nonzero(at) < fewest:
            continue
        moves = np.concatenate([[False], columns.q[joint, 1:] != columns.q[joint, :-1]])
        at &= moves
        count = int(np.count_nonzero(at))
        if count < fewest:
            continue
        start, length = _longest_run(at)
        beside = int(((distance >= 0.5 * width) & (distance < 1.5 * width) & moves).sum())
        if length < CLIPPED_RUN or count < CLIPPED_PILE * max(beside, 1):
            continue
        share += count / len(values)
        at_limit.append(extreme)
        if length > run:
            run, begins = length, start
    if not at_limit:
        return []
    off = at_limit == [0.0]
    return [
        Finding(
            name="zero_torque" if off else "clipped",
            severity="warning",
            text=f"stays at {' and '.join(f'{value:.6g}' for value in at_limit)}: "
            f"{100 * share:.3g} % of the rows, up to {run} in a row",
            action="remove the rows in which the drive is off"
            if off
            else "the signal is probably saturated: remove these rows, or record a slower motion",
            value=100 * share,
            unit="%",
            column=f"{columns.prefix}{joint + 1}",
            joint=joint + 1,
            row=begins + 1,
        )
    ]


def _longest_run(flags: NDArray[np.bool_]) -> tuple[int, int]:
    """Finds the longest run of True: its start and its length, (0, 0) without any."""
    starts, stops = ends(flags)
    if not len(starts):
        return 0, 0
    best = int(np.argmax(stops - starts))
    return int(starts[best]), int(stops[best] - starts[best])
