"""Columns that hold, repeat or exceed what a sensor measures."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimation.gate.context import Context
from estimation.gate.finding import Finding
from estimation.recordings.rows.columns import Columns
from robots.common.stretches import ends

# A torque is clipped at an extreme value if it holds it in a run of so many rows, in so many times the rows of the step
# next to it, ...
CLIPPED_RUN, CLIPPED_PILE = 5, 8.0
# ... and in this share of all rows.
CLIPPED_SHARE = 5e-4
# A step at an extreme value: the resolution of the column, or this share of its range if that is larger.
WIDTH = 1e-6


def clipping(context: Context) -> list[Finding]:
    """Finds torques or currents that accumulate at their largest or smallest value.

    A smooth peak is at most some three times as long in its last step as in the one before. A limit holds the torque
    longer. Rows in which the joint stands do not count: a brake holds the torque as well. Torques of exactly zero come
    from a drive that is off, and are reported as such.
    """
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


def constant_torques(context: Context) -> list[Finding]:
    """Finds torques or currents that are constant."""
    columns = context.recorded.columns
    if columns.signal is None:
        return []
    return [
        Finding(
            name="constant_torque",
            severity="warning" if columns.varies.any() else "refuse",
            text=f"has the constant value {columns.signal[joint, 0]:.4g}",
            action="record the torque of the moving arm, and check the meaning of the column",
            value=float(columns.signal[joint, 0]),
            unit="A" if columns.prefix == "i" else "N m or N",
            column=f"{columns.prefix}{joint + 1}",
            joint=int(joint) + 1,
        )
        for joint in np.flatnonzero(~columns.varies)
    ]


def held_torques(context: Context) -> list[Finding]:
    """Reports torques that keep each value for some rows. They are interpolated between their updates."""
    recorded = context.recorded
    if not len(recorded.updates):
        return []
    usual = int(np.median(np.diff(recorded.updates)))
    prefix, n = recorded.columns.prefix, context.robot.n
    return [
        Finding(
            name="held_torque",
            severity="warning",
            text=f"{prefix}1 to {prefix}{n} change only in every {usual}th row "
            f"({1 / (usual * recorded.timing.period):.3g} Hz), which looks like a delay",
            action="they are interpolated between these rows; log them as often as the positions if the controller can",
            value=float(usual),
            unit="rows",
            row=int(recorded.updates[1]) + 1,
        )
    ]


def impossible_values(context: Context) -> list[Finding]:
    """Refuses a log with impossible values that are not isolated outliers."""
    return [
        Finding(
            name="absurd_value",
            severity="refuse",
            text=f"reaches {found.value:.4g}",
            action="repair or remove these rows",
            value=found.value,
            column=f"{found.prefix}{found.joint + 1}",
            joint=found.joint + 1,
            row=found.row + 1,
        )
        for found in context.cleaned.impossible
    ]


# Step of a torque over its standard deviation, above which it adds to the usual noise.
COARSE_TORQUE = 0.1
# Encoder steps over the whole motion, below which velocities are coarse; a fifth of it is a warning.
COARSE_POSITION = 500


def resolution(context: Context) -> list[Finding]:
    """Finds positions, torques or currents with steps that are coarse for what they measure."""
    columns = context.recorded.columns
    joints = range(len(columns.q))
    return [finding for j in joints for finding in (*_position(columns, j), *_signal(columns, j))]


def _position(columns: Columns, joint: int) -> list[Finding]:
    step, travel = float(columns.position_steps[joint]), float(columns.travel[joint])
    if not (step > 0 and travel > 0 and travel / step < COARSE_POSITION):
        return []
    return [
        Finding(
            name="quantised_position",
            severity="warning" if travel / step < COARSE_POSITION / 5 else "info",
            text=f"coarse resolution: steps of {step:.3g}, only {travel / step:.0f} of them over the whole motion",
            action="the position is smoothed before differentiation; log positions with more digits",
            value=step,
            unit="rad or m",
            column=f"q{joint + 1}",
            joint=joint + 1,
        )
    ]


def _signal(columns: Columns, joint: int) -> list[Finding]:
    step, spread = float(columns.signal_steps[joint]), float(columns.spread[joint])
    if not step > COARSE_TORQUE * spread > 0:
        return []
    return [
        Finding(
            name="quantised_torque",
            severity="warning" if step > spread else "info",
            text=f"coarse resolution: steps of {step:.3g}, {100 * step / spread:.3g} % of its standard deviation",
            action="treated as noise; log it with more digits",
            value=step,
            unit="A" if columns.prefix == "i" else "N m or N",
            column=f"{columns.prefix}{joint + 1}",
            joint=joint + 1,
        )
    ]


# Number of rows that are compared first: they distinguish most columns.
COMPARED_FIRST = 50


def same_columns(context: Context) -> list[Finding]:
    """Finds a column that is equal to another in every row. Two joints are never so alike: one column was copied."""
    known = context.recorded.columns.named()
    varying = [(f"{prefix}{j + 1}", j, column) for prefix, j, column in known if column.min() < column.max()]
    findings = []
    for i, (name, joint, column) in enumerate(varying):
        step = max(1, len(column) // COMPARED_FIRST)
        equal = (
            other
            for other, _, values in varying[:i]
            if np.array_equal(values[::step], column[::step]) and np.array_equal(values, column)
        )
        original = next(equal, None)
        if original is not None:
            findings.append(
                Finding(
                    name="same_column",
                    severity="warning",
                    text=f"is identical to {original} in every row",
                    action="one column was copied; the parameters of both joints are unreliable",
                    value=float(len(column)),
                    unit="rows",
                    column=name,
                    joint=joint + 1,
                )
            )
    return findings


def stuck_columns(context: Context) -> list[Finding]:
    """Finds columns that hold one value while the arm moves, and then jump."""
    return [
        Finding(
            name="stuck",
            severity="warning",
            text=f"keeps one value for {hang.rows} rows while the arm moves, and then jumps",
            action="the log is split there; repair the logger",
            value=float(hang.rows),
            unit="rows",
            column=f"{hang.prefix}{hang.joint + 1}",
            joint=hang.joint + 1,
            row=hang.first + 1,
        )
        for hang in context.recorded.hangs
    ]
