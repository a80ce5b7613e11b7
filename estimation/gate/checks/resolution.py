"""Resolution and range of the sensors: steps of position and torque, and torques that pile up at an extreme."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimation.gate.checks.timing import longest_run
from estimation.gate.columns import Columns
from estimation.gate.finding import Finding

Array = NDArray[np.float64]

# Values looked at to find a column's step.
SAMPLES = 20_000
# A step of the torque above this share of its standard deviation costs more than the usual noise.
COARSE_TORQUE = 0.1
# A range of fewer encoder steps than this leaves little of the velocity.
COARSE_POSITION = 500
# An extreme is clipped where it holds so many rows in a row, so many times the rows of the step next to it, ...
CLIPPED_RUN, CLIPPED_PILE = 5, 8.0
# ... and this share of all.
CLIPPED_SHARE = 5e-4


def lattice_step(values: Array) -> float:
    """Finds the step of a quantised column, 0 where there is none.

    The smallest distance between neighbouring values is the step when nearly all distances are multiples of it.

    Args:
        values: (N,).
    """
    chosen = values[:: max(1, len(values) // SAMPLES)]
    distinct = np.unique(chosen)
    if len(distinct) < 3 or len(distinct) > 0.9 * len(chosen):
        # As many values as samples: a resolution step, if any, is too small to be detected.
        return 0.0
    scale = max(float(np.abs(distinct).max()), 1e-300)
    distances = np.diff(distinct)
    distances = distances[distances > 1e-9 * scale]
    if len(distances) < 2:
        return 0.0
    step = float(np.quantile(distances, 0.01))
    multiples = distances / step
    near = np.abs(multiples - np.round(multiples)) < 0.05
    # Rounding in the file blurs high multiples: only low ones are used.
    low = multiples < 10.5
    if not low.any() or near[low].mean() < 0.95:
        return 0.0
    steps = low & (multiples > 0.5)
    return float(np.median(distances[steps] / np.round(multiples[steps])))


def check_resolution(columns: Columns) -> list[Finding]:
    """Finds steps of position, torque or current that are coarse against what they measure.

    Args:
        columns: of the log.
    """
    findings = []
    signal, name = columns.signal, columns.prefix
    for joint in range(len(columns.q)):
        step, travel = lattice_step(columns.q[joint]), float(columns.travel[joint])
        if step > 0 and travel > 0 and travel / step < COARSE_POSITION:
            findings.append(
                Finding(
                    name="quantised_position",
                    severity="warning" if travel / step < COARSE_POSITION / 5 else "info",
                    text=(
                        f"coarse resolution: steps of {step:.3g}, only {travel / step:.0f} of them over the whole "
                        f"motion"
                    ),
                    action="the position is smoothed before differentiation; log positions with more digits",
                    value=step,
                    unit="rad or m",
                    column=f"q{joint + 1}",
                    joint=joint + 1,
                )
            )
        if signal is None:
            continue
        step, spread = lattice_step(signal[joint]), float(columns.spread[joint])
        if step > COARSE_TORQUE * spread > 0:
            findings.append(
                Finding(
                    name="quantised_torque",
                    severity="warning" if step > spread else "info",
                    text=(
                        f"coarse resolution: steps of {step:.3g}, {100 * step / spread:.3g} % of its standard deviation"
                    ),
                    action="treated as noise; log it with more digits",
                    value=step,
                    unit="A" if name == "i" else "N m or N",
                    column=f"{name}{joint + 1}",
                    joint=joint + 1,
                )
            )
    return findings


def check_clipping(columns: Columns) -> list[Finding]:
    """Finds torques or currents that pile up at their largest or smallest value.

    A smooth peak spends at most some three times as long in its last step as in the one before; a limit holds it
    there. Rows in which the joint stands do not count: a brake holds the torque as well.

    Args:
        columns: of the log.

    A joint that rests or is off at exactly zero is reported as such.
    """
    findings = []
    name = columns.prefix
    for joint, values in enumerate(() if columns.signal is None else columns.signal):
        low, high = float(values.min()), float(values.max())
        if high == low:
            continue
        width = max(lattice_step(values), 1e-6 * (high - low))
        moves = np.concatenate([[False], columns.q[joint, 1:] != columns.q[joint, :-1]])
        share, run, begins, at_limit = 0.0, 0, 0, []
        for extreme, side in ((high, 1.0), (low, -1.0)):
            distance = side * (extreme - values)
            at = (distance < 0.5 * width) & moves
            count = int(at.sum())
            if count < CLIPPED_RUN or count < CLIPPED_SHARE * len(values):
                continue
            start, length = longest_run(at)
            beside = int(((distance >= 0.5 * width) & (distance < 1.5 * width) & moves).sum())
            if length < CLIPPED_RUN or count < CLIPPED_PILE * max(beside, 1):
                continue
            share += count / len(values)
            at_limit.append(extreme)
            if length > run:
                run, begins = length, start
        if at_limit:
            off = at_limit == [0.0]
            findings.append(
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
                    column=f"{name}{joint + 1}",
                    joint=joint + 1,
                    row=begins + 1,
                )
            )
    return findings
