"""A linear filter per joint that makes torque noise white, for torque and hypotheses alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal, overload

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.noise_models.frequency_bands import Band
from estimation.diagnosis.noise_models.masked_rows import MaskedRows
from estimation.linear_algebra.free_torque import FreeTorque, Real, span_of
from robots.common.stretches import spans

Array = NDArray[np.float64]
Small = NDArray[np.float32]

# A filter lets through this share of what is at rest at least: what it says of less is chance.
LEAST_AT_REST = 0.01


@dataclass(frozen=True, eq=False)
class Whitening:
    """A linear filter per joint that makes the noise white, of unit variance, and knows its correlation.

    Attributes:
        coefficients: per joint the prediction filter (p_j,).
        scale: standard deviation of the innovations (n,) [N m or N].
        precision: inverse correlation of the innovations of the joints (n, n).
        starts: rows at which a log begins: the filters start anew.
        masked: rows of each joint that do not count.
        bands: each joint's: where motion is known. Rows are thinned alike.
        weights: of the white rows (N, n): those that no noise explains count less; None for ones.
        levels: of the noise of each log, in units of `scale` (logs, n); None for ones.
    """

    coefficients: tuple[Array, ...]
    scale: Array
    precision: Array
    starts: tuple[int, ...]
    masked: MaskedRows
    bands: tuple[Band, ...]
    weights: Array | None = None
    levels: Array | None = None

    @property
    def stride(self) -> int:
        """Rows of a log that become one."""
        return self.bands[0].stride

    def level(self, run: int, joint: int) -> float:
        """The noise of a log, in units of `scale`."""
        return 1.0 if self.levels is None else float(self.levels[run, joint])

    def taps(self, joint: int) -> Array:
        """Gives a joint's filter (p_j + 1,), for the noise of a log of level one."""
        return np.concatenate([[1.0], -self.coefficients[joint]]) / self.scale[joint]

    @property
    def at_rest(self) -> Array:
        """The noise's density at rest, as the standard deviation of white noise that has as much there (n,)."""
        gains = [max(abs(1.0 - float(np.sum(a))), LEAST_AT_REST) for a in self.coefficients]
        return self.scale / np.array(gains)

    @property
    def row_weight(self) -> float:
        """Power density of the noise at rest over that of white noise of its innovations, per row of the log.

        So many plain rows, weighted by the innovations' scale, hold as much information on a slow torque as one row of
        white noise.
        """
        return self.stride * float(np.mean(np.square(self.at_rest / self.scale)))

    def scales(self, rows: int) -> Array:
        """Gives the standard deviation of the innovations of each of a recording's rows (N, n) [N m or N]."""
        levels = np.ones((len(self.starts), len(self.scale))) if self.levels is None else self.levels
        return np.repeat(levels * self.scale, np.diff([*self.starts, rows]), axis=0)

    def apply(self, series: Array, joint: int) -> Array:
        """Whitens columns (N,) or (N, k) of one joint, counted from 0."""
        return self.counted(self.filtered(series, joint), joint)

    @overload
    def filtered(self, series: Array, joint: int, *, single: Literal[False] = False) -> Array: ...
    @overload
    def filtered(self, series: Array, joint: int, *, single: Literal[True]) -> Small: ...
    def filtered(self, series: Array, joint: int, *, single: bool = False) -> Array | Small:
        """Does what `apply` does, rows that do not count included; in `single` precision twice as fast."""
        series = self.masked.bridged(series, joint)
        taps, band = self.taps(joint), self.bands[joint]
        white = (
            band.passed(series, taps, starts=self.starts, single=True)
            if single
            else band.passed(series, taps, starts=self.starts)
        )
        # Before a log there is nothing to predict from: its first rows would weigh as if they were shocks.
        rise = np.linspace(0, 1, len(taps))[1:, *(None,) * (series.ndim - 1)]
        first = 0
        for run, (start, stop) in enumerate(pairwise((*self.starts, len(series)))):
            own = white[first : (first := first + -(-(stop - start) // band.stride))]
            own[: len(rise)] *= rise[: len(own)]
            if self.levels is not None:
                own /= self.level(run, joint)
        return white

    def counted(self, white: NDArray[Real], joint: int) -> NDArray[Real]:
        """Leaves out of white columns what is in rows that do not count."""
        white = self.masked.project_out(white, joint)
        if self.weights is None:
            return white
        weights = self.weights[:, joint, *(None,) * (white.ndim - 1)]
        return white * weights.astype(white.dtype, copy=False)

    def adjoint(self, white: Array, joint: int, rows: int) -> Array:
        """Gives what each of a joint's rows (N,) has to do with white ones (M,): <apply(x), white> = <x, adjoint>.

        But for x in the first rows of a log.
        """
        if self.weights is not None:
            white = white * self.weights[:, joint]
        return self.unfiltered(self.masked.project_out(white, joint), joint, rows)

    def unfiltered(self, white: Array, joint: int, rows: int) -> Array:
        """The same of `filtered`."""
        taps = self.taps(joint)
        band, parts, first = self.bands[joint], [], 0
        for run, (start, stop) in enumerate(pairwise((*self.starts, rows))):
            count = -(-(stop - start) // band.stride)
            thinned = np.zeros(stop - start)
            # The low-pass is its own adjoint, for it has no delay.
            thinned[:: band.stride] = np.convolve(white[first : first + count], taps[::-1])[len(taps) - 1 :]
            parts.append(replace(band, stride=1).passed(thinned) / self.level(run, joint))
            first += count
        return self.masked.bridge_adjoint(np.concatenate(parts), joint)

    def all(self, series: Array) -> Array:
        """Whitens (N, n) or (N, n, k)."""
        return np.stack([self.apply(series[:, j], j) for j in range(series.shape[1])], axis=1)

    def independent(self, series: Array) -> Array:
        """Whitens (N, n) or (N, n, k) across the joints too: a row each of white row and joint, (N n,) or (N n, k)."""
        root = np.linalg.cholesky(self.precision)  # P = L L'
        mixed = np.einsum("jk,nj...->nk...", root, self.all(series), optimize=True)
        return np.asarray(mixed.reshape(-1, *series.shape[2:]))


def free_columns(
    unsure: NDArray[np.bool_], longest: int, whitening: Whitening, widths: Sequence[float]
) -> tuple[FreeTorque, ...]:
    """Builds the white columns of the short gaps: polynomials over each, one for every `widths[j]` rows and one more.

    Each is whitened where it is not zero only, so that a long log costs no more a gap than a short one.
    """
    result = []
    for j, (column, width) in enumerate(zip(unsure.T, widths, strict=True)):
        beside = int(np.ceil(1.5 * width)) + 2
        pieces: list[tuple[int, Array]] = []
        first_row = 0
        for run, (run_start, run_stop) in enumerate(pairwise((*whitening.starts, len(column)))):
            for gap in spans(column[run_start:run_stop]):
                for start, stop in _short(*gap, longest, beside, run_stop - run_start):
                    x = np.linspace(-1, 1, stop - start) if stop - start > 1 else np.zeros(1)
                    number = min(stop - start, int(np.ceil((stop - start) / width)) + 1)
                    shapes = np.asarray(np.polynomial.legendre.legvander(x, number - 1), dtype=np.float64)
                    row, white = _white_gap(whitening, j, start, shapes, run_stop - run_start)
                    pieces.append((first_row + row, white / whitening.level(run, j)))
            first_row += -(-(run_stop - run_start) // whitening.stride)
        result.append(span_of(pieces, first_row))
    return tuple(result)


def _white_gap(whitening: Whitening, joint: int, start: int, shapes: Array, rows: int) -> tuple[int, Array]:
    """Whitens functions of a gap (m, k) that begins at a row of a log: the first white row, and the white rows."""
    band = whitening.bands[joint]
    half, stride = len(band.taps) // 2, band.stride
    taps = whitening.taps(joint)
    low = max(0, start - half - stride) // stride * stride
    high = min(rows, start + len(shapes) + half + (len(taps) + 1) * stride)
    segment = np.zeros((high - low, shapes.shape[1]))
    segment[start - low : start - low + len(shapes)] = shapes
    white = band.passed(segment, taps)
    first = low // stride
    lead = max(0, min(len(taps) - 1 - first, len(white)))
    white[:lead] *= np.linspace(0, 1, len(taps))[1 + first : 1 + first + lead, None]
    return first, white


def _short(start: int, stop: int, longest: int, beside: int, rows: int) -> list[tuple[int, int]]:
    """A short gap as it is; of a long one both ends, where the joint came to rest or broke loose with a kick."""
    if stop - start <= longest:
        return [(start, stop)]
    ends = [(max(edge - beside, 0), min(edge + beside, rows)) for edge in (start, stop) if 0 < edge < rows]
    return ends
