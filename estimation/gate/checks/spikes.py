"""Outliers in single rows: a garbled message, a dropout, a typing error."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimation.gate.checks.resolution import lattice_step
from estimation.gate.columns import Columns
from estimation.gate.finding import Finding

Array = NDArray[np.float64]

# A row is an outlier if it leaves and comes back by this multiple of the usual back and forth ...
OUT = 25.0
# ... and by this share of what the column does otherwise: a position cannot come back at once, a torque may.
SHARE_OF_POSITION, SHARE_OF_SIGNAL = 0.01, 0.1
# Steps of a coarse sensor between which its value flickers.
FLICKER = 3.0
# Share of rows above which they are no accident: of a torque they count as noise then, of a position they spoil it.
MANY = 0.03
# Outliers of torque close to a reversal of any joint are not accidents, if most outliers are there: friction
# that turns round jerks the arm, and a sharp fall of it makes a peak.
BESIDE, MOST = 4, 0.5


def spike_rows(values: Array, share: float, *, noisy: bool) -> NDArray[np.intp]:
    """Finds the outliers of a column (N,): a step away, and the same step back.

    The back and forth of a row is the smaller of its two steps where they have opposite signs. Noise of any usual
    distribution stays within a few times its median; a step, as at a reversal of friction, does not come back.

    Args:
        values: the column.
        share: of the range between its outer twentieths that a spike must exceed.
        noisy: whether back and forth is usual: a position goes on in its direction, save for the flicker of its sensor.
    """
    steps = np.diff(values)
    before, after = steps[:-1], steps[1:]
    back = np.where((before > 0) != (after > 0), np.minimum(np.abs(before), np.abs(after)), 0.0)
    thinned = values[:: max(1, len(values) // 20_000)]
    # Quartiles rather than the range, which the spikes themselves would set.
    low, high = np.quantile(thinned, (0.05, 0.95))
    usual = back[:: max(1, len(back) // 20_000)]
    if noisy:
        usual = usual[usual > 0]
    noise = OUT * float(np.median(usual)) if len(usual) else 0.0
    level = max(noise, share * float(high - low), FLICKER * (lattice_step(values) or _between_two(values)))
    if not level > 0:
        return np.empty(0, dtype=np.intp)
    return np.flatnonzero(back > level) + 1


def _between_two(values: Array) -> float:
    """The step of a sensor at rest that flickers between two values, too often for accidents; 0 for any other."""
    low, high = float(values.min()), float(values.max())
    at = [int(np.count_nonzero(values == value)) for value in (low, high)]
    return high - low if low < high and sum(at) == len(values) and min(at) > MANY * len(values) else 0.0


def dropouts(values: Array, q: Array) -> NDArray[np.intp]:
    """Finds rows in which a torque or current is exactly zero although the joint moves: lost messages.

    Args:
        values: the column (N,).
        q: the joint's position (N,).
    """
    rows = np.flatnonzero((values[1:] == 0.0) & (q[1:] != q[:-1])) + 1
    # In a coarse torque, zero is a normal value, and a drive that is off is not an accident.
    if not 2 <= len(rows) <= MANY * len(values) or lattice_step(values) > 0:
        return np.empty(0, dtype=np.intp)
    return rows


def stray_rows(columns: Columns) -> dict[tuple[str, int], NDArray[np.intp]]:
    """Finds the outliers in each column of position and of torque or current.

    Args:
        columns: of the log.

    Returns:
        Rows by the column's prefix and joint, counted from 0; only columns that have some.
    """
    found: dict[tuple[str, int], NDArray[np.intp]] = {}
    for joint, column in enumerate(columns.q):
        found["q", joint] = spike_rows(column, SHARE_OF_POSITION, noisy=False)
    signals = [] if columns.signal is None else list(columns.signal)
    peaks = [spike_rows(column, SHARE_OF_SIGNAL, noisy=True) for column in signals]
    if any(map(len, peaks)):
        turning = _turning(columns)
        peaks = [_away(rows, turning) for rows in peaks]
    for joint, (column, rows) in enumerate(zip(signals, peaks, strict=True)):
        found[columns.prefix, joint] = np.union1d(rows, dropouts(column, columns.q[joint]))
    return {place: rows for place, rows in found.items() if len(rows)}


def _turning(columns: Columns) -> NDArray[np.bool_]:
    """Marks rows (N,) beside those in which any joint turns round, starts or stops."""
    turning = np.zeros(len(columns.q[0]), dtype=bool)
    for q in columns.q:
        # Over some rows, for the noise of an encoder turns no motion round.
        way = np.sign(q[BESIDE:] - q[:-BESIDE])
        turns = np.flatnonzero(way[1:] != way[:-1]) + BESIDE // 2
        turning[np.unique(np.clip(turns[:, None] + np.arange(-BESIDE, BESIDE + 1), 0, len(q) - 1))] = True
    return turning


def _away(rows: NDArray[np.intp], turning: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Leaves out rows of torque beside reversals, where most of them are and chance puts few."""
    beside = turning[rows]
    return rows[~beside] if len(rows) and beside.mean() > MOST > 2 * turning.mean() else rows


def are_accidents(rows: NDArray[np.intp], samples: int) -> bool:
    """Whether outliers are few enough to be ignored in a column of this length."""
    return len(rows) <= MANY * samples


def check_spikes(columns: Columns) -> tuple[list[Finding], NDArray[np.intp]]:
    """Finds spikes of position and of torque or current.

    Args:
        columns: of the log.

    Returns:
        The findings, and the rows with an outlier in any column.
    """
    findings: list[Finding] = []
    rows: list[NDArray[np.intp]] = []
    for (prefix, joint), found in stray_rows(columns).items():
        column = (columns.q if prefix == "q" or columns.signal is None else columns.signal)[joint]
        many = not are_accidents(found, len(column))
        if not many:
            rows.append(found)
        findings.append(
            Finding(
                name="spikes",
                severity="refuse" if many and prefix == "q" else "warning",
                text=f"{len(found)} outlier{'s' if len(found) > 1 else ''}, the first with "
                f"{float(column[found[0]]):.4g} between {float(column[found[0] - 1]):.4g} and "
                f"{float(column[found[0] + 1]):.4g}",
                action="too many to ignore: repair the logger" if many else "these rows are ignored",
                value=float(len(found)),
                unit="rows",
                column=f"{prefix}{joint + 1}",
                joint=joint + 1,
                row=int(found[0]) + 1,
            )
        )
    return findings, np.unique(np.concatenate(rows)) if rows else np.empty(0, dtype=np.intp)
