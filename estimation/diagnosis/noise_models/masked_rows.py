"""Masked rows: rows in which a joint's direction of motion is unknown, interpolated or fitted by a free torque."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from estimation.linear_algebra.free_torque import FreeTorque, Real
from robots.common.arrays import Array
from robots.common.stretches import spans


@dataclass(frozen=True, eq=False)
class MaskedRows:
    """Rows in which a joint's direction of motion, and so the sign of its friction, is unknown.

    Friction that changes sign in such rows would ring far beyond them in a filter. Torque and hypotheses are therefore
    interpolated linearly over them. In short stretches a free torque is fitted in addition, with as many coefficients
    as the band can resolve. It is projected out of the white columns of torque and hypotheses. Long stretches, in which
    the joint rests, do not count.

    Attributes:
        bridges: per joint: masked rows, the counted rows before and after them, and the weight of the latter.
        free: per joint: white columns of the free torque in short stretches, to be projected out.
    """

    bridges: tuple[tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp], Array], ...]
    free: tuple[FreeTorque, ...]

    def bridged(self, series: Array, joint: int) -> Array:
        """Interpolates columns (N,) or (N, k) of a joint, counted from 0, over its masked rows."""
        rows, before, after, weight = self.bridges[joint]
        if not len(rows):
            return series
        result = series.copy(order="K")
        # Along the rows, which are contiguous in memory in the usual columns.
        result.T[..., rows] = (1 - weight) * series.T[..., before] + weight * series.T[..., after]
        return result

    def bridge_adjoint(self, slope: Array, joint: int) -> Array:
        """Applies the adjoint of `bridged` to a gradient (N,): moves it from masked rows to the rows beside them."""
        rows, before, after, weight = self.bridges[joint]
        result = slope.copy()
        result[rows] = 0.0
        np.add.at(result, before, (1 - weight) * slope[rows])
        np.add.at(result, after, weight * slope[rows])
        return result

    def project_out(self, white: NDArray[Real], joint: int) -> NDArray[Real]:
        """Projects the free torque of short masked stretches out of white columns of a joint."""
        return self.free[joint].projected_out(white) if joint < len(self.free) else white

    def resting(self, starts: tuple[int, ...], rows: int, stride: int, margin: int) -> NDArray[np.bool_]:
        """Marks the decimated rows (M, n) of masked stretches, and `margin` rows beside them."""
        columns = []
        for at, *_ in self.bridges:
            flags = np.zeros(rows, dtype=bool)
            flags[at] = True
            parts = [flags[start:stop] for start, stop in pairwise((*starts, rows))]
            columns.append(np.concatenate([binary_dilation(part, iterations=margin)[::stride] for part in parts]))
        return np.column_stack(columns)


def find_masked_rows(unsure: NDArray[np.bool_], starts: tuple[int, ...], longest: int = 0) -> MaskedRows:
    """Masks stretches of flagged rows (N, n) longer than `longest`; interpolation stays within a log."""
    bridges = []
    for column in unsure.T:
        flags = np.zeros_like(column)
        for start, stop in spans(column):
            if stop - start > longest:
                flags[start:stop] = True
        pieces = []
        for start, stop in pairwise((*starts, len(column))):
            rows, good = np.flatnonzero(flags[start:stop]), np.flatnonzero(~flags[start:stop])
            if not len(rows):
                continue
            if not len(good):
                good = rows[:1]  # a joint that rests in this log: a constant, which does not count
            at = np.searchsorted(good, rows)
            before, after = good[np.maximum(at - 1, 0)], good[np.minimum(at, len(good) - 1)]
            before = np.where(at == 0, after, before)
            weight = np.where(after > before, (rows - before) / np.maximum(after - before, 1), 0.0)
            pieces.append((rows + start, before + start, after + start, np.clip(weight, 0.0, 1.0)))
        empty = np.zeros(0, dtype=np.intp)
        if pieces:
            rows, before, after, weight = (np.concatenate(part) for part in zip(*pieces, strict=True))
        else:
            rows, before, after, weight = empty, empty, empty, np.zeros(0)
        bridges.append((rows, before, after, weight))
    return MaskedRows(tuple(bridges), ())


def no_masked_rows(joints: int) -> MaskedRows:
    """Builds masked rows for a motion whose direction is known throughout: none."""
    none = np.zeros(0, dtype=np.intp)
    return MaskedRows(((none, none, none, np.zeros(0)),) * joints, ())
