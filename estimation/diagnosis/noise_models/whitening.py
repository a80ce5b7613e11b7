"""Linear filters, one per joint, that whiten the torque noise; torque and hypotheses pass the same filters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, Literal, overload

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.noise_models.frequency_bands import Band
from estimation.diagnosis.noise_models.masked_rows import MaskedRows
from estimation.linear_algebra.free_torque import FreeTorque, Real, span_of
from estimation.regressions.moments import Moments
from estimation.uncertainty.autoregressive import taps
from robots.common.arrays import Array
from robots.common.stretches import spans

Small = NDArray[np.float32]

# Approximate number of rows that are checked first for a column that is not zero.
GLANCE = 64
# Least gain of a whitening filter at zero frequency: a smaller estimate is chance.
LEAST_AT_REST = 0.01


@dataclass(frozen=True, eq=False)
class Whitening:
    """One linear filter per joint that makes the noise white with unit variance, and the correlation of joints.

    Attributes:
        coefficients: prediction filter of each joint (p_j,).
        scale: standard deviation of the innovations (n,) [N m or N].
        precision: inverse of the joints' innovation correlation (n, n).
        starts: first row of each log; the filters restart there.
        masked: rows of each joint that do not count.
        bands: usable band of each joint; all have the same decimation.
        weights: weights of the white rows (M, n), lower for outliers and zero at rest; None for ones.
        levels: noise level of each log over `scale` (logs, n); None for ones.
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
        """Decimation: rows of a log per white row."""
        return self.bands[0].stride

    def level(self, run: int, joint: int) -> float:
        """Returns the noise level of a log over `scale`."""
        return 1.0 if self.levels is None else float(self.levels[run, joint])

    def taps(self, joint: int) -> Array:
        """Returns a joint's filter (p_j + 1,), for the noise of a log of level one."""
        return taps(self.coefficients[joint]) / self.scale[joint]

    @property
    def at_rest(self) -> Array:
        """Noise density at zero frequency, as the standard deviation of equivalent white noise (n,) [N m or N]."""
        gains = [max(abs(1.0 - float(np.sum(a))), LEAST_AT_REST) for a in self.coefficients]
        return self.scale / np.array(gains)

    @property
    def row_weight(self) -> float:
        """Power density of the noise at zero frequency over that of the innovations, times the decimation.

        This many rows, weighted by the innovations' scale, hold as much information on a slow torque as one row of
        white noise.
        """
        return self.stride * float(np.mean(np.square(self.at_rest / self.scale)))

    def scales(self, rows: int) -> Array:
        """Returns the standard deviation of the innovations in each row of a recording (N, n) [N m or N]."""
        levels = np.ones((len(self.starts), len(self.scale))) if self.levels is None else self.levels
        return np.repeat(levels * self.scale, np.diff([*self.starts, rows]), axis=0)

    def apply(self, series: Array, joint: int) -> Array:
        """Whitens columns (N,) or (N, k) of one joint, counted from 0."""
        return self.both(series, joint)[1]

    @overload
    def both(self, series: Array, joint: int, *, single: Literal[False] = False) -> tuple[Array, Array]: ...
    @overload
    def both(self, series: Array, joint: int, *, single: Literal[True]) -> tuple[Small, Small]: ...
    def both(self, series: Array, joint: int, *, single: bool = False) -> tuple[Array | Small, Array | Small]:
        """Whitens columns of a joint with all rows, and as `apply` does. Columns that are zero cost nothing."""
        if series.ndim == 1 or (acts := acting(series)).all():
            whole: Any = self.filtered(series, joint, single=True) if single else self.filtered(series, joint)
            return whole, self.counted(whole, joint)
        some = self.both(series[:, acts], joint, single=True) if single else self.both(series[:, acts], joint)
        result = []
        for part in some:
            result.append(np.zeros((len(part), len(acts)), part.dtype, order="F"))
            result[-1][:, acts] = part
        return result[0], result[1]

    @overload
    def filtered(self, series: Array, joint: int, *, single: Literal[False] = False) -> Array: ...
    @overload
    def filtered(self, series: Array, joint: int, *, single: Literal[True]) -> Small: ...
    def filtered(self, series: Array, joint: int, *, single: bool = False) -> Array | Small:
        """Filters columns as `apply` does, before masks and weights; in `single` precision twice as fast."""
        series = self.masked.bridged(series, joint)
        taps, band = self.taps(joint), self.bands[joint]
        white = (
            band.passed(series, taps, starts=self.starts, single=True)
            if single
            else band.passed(series, taps, starts=self.starts)
        )
        # The filter has no past at the start of a log. Full weight would make its first rows look like shocks.
        rise = np.linspace(0, 1, len(taps))[1:, *(None,) * (series.ndim - 1)]
        first = 0
        for run, (start, stop) in enumerate(pairwise((*self.starts, len(series)))):
            own = white[first : (first := first + -(-(stop - start) // band.stride))]
            own[: len(rise)] *= rise[: len(own)]
            if self.levels is not None:
                own /= self.level(run, joint)
        return white

    def counted(self, white: NDArray[Real], joint: int) -> NDArray[Real]:
        """Applies masks and weights to white columns of a joint."""
        white = self.masked.project_out(white, joint)
        if self.weights is None:
            return white
        weights = self.weights[:, joint, *(None,) * (white.ndim - 1)]
        return white * weights.astype(white.dtype, copy=False)

    def adjoint(self, white: Array, joint: int, rows: int) -> Array:
        """Maps white rows (M,) of a joint back by the adjoint A* of `apply`: <apply(x), white> = <x, A* white>.

        This holds for x that is zero in the first rows of each log.

        Args:
            white: the white rows.
            joint: the joint, counted from 0.
            rows: number of rows of the recording.

        Returns:
            Values at the rows of the recording (N,).
        """
        if self.weights is not None:
            white = white * self.weights[:, joint]
        return self.unfiltered(self.masked.project_out(white, joint), joint, rows)

    def unfiltered(self, white: Array, joint: int, rows: int) -> Array:
        """Applies the adjoint of `filtered` to white rows (M,), as `adjoint` does."""
        taps = self.taps(joint)
        band, parts, first = self.bands[joint], [], 0
        for run, (start, stop) in enumerate(pairwise((*self.starts, rows))):
            count = -(-(stop - start) // band.stride)
            thinned = np.zeros(stop - start)
            # A low-pass without delay is its own adjoint.
            thinned[:: band.stride] = np.convolve(white[first : first + count], taps[::-1])[len(taps) - 1 :]
            parts.append(replace(band, stride=1).passed(thinned) / self.level(run, joint))
            first += count
        return self.masked.bridge_adjoint(np.concatenate(parts), joint)

    def all(self, series: Array) -> Array:
        """Whitens (N, n) or (N, n, k), joint by joint."""
        return np.stack([self.apply(series[:, j], j) for j in range(series.shape[1])], axis=1)

    def independent(self, series: Array) -> Array:
        """Whitens (N, n) or (N, n, k) also across joints.

        Returns:
            One row for each white row and joint, (N n,) or (N n, k).
        """
        root = np.linalg.cholesky(self.precision)  # P = L L'
        mixed = np.einsum("jk,nj...->nk...", root, self.all(series), optimize=True)
        return np.asarray(mixed.reshape(-1, *series.shape[2:]))

    def moments(self, columns: Array, tau: Array) -> Moments:
        """Sums the normal equations of columns (N, n, k) and torque (N, n), whitened also across joints."""
        return Moments.of(self.independent(columns)[:, None], self.independent(tau)[:, None])


def acting(columns: Array) -> NDArray[np.bool_]:
    """Marks columns (N, ...) that are not all zero; a few rows usually decide."""
    nonzero = np.asarray(columns[:: len(columns) // GLANCE + 1].any(axis=0))
    nonzero[~nonzero] = columns[:, ~nonzero].any(axis=0)
    return nonzero


def free_columns(
    unsure: NDArray[np.bool_], longest: int, whitening: Whitening, widths: Sequence[float]
) -> tuple[FreeTorque, ...]:
    """Builds white columns for the free torque of short masked stretches of each joint.

    Each stretch gets polynomials, one more than the number of `widths[j]` rows it spans. Of a long stretch only the two
    ends get them. Each column is whitened only where it is not zero, so that costs do not grow with the length of the
    log.

    Args:
        unsure: masked rows (N, n).
        longest: rows up to which a stretch is short.
        whitening: the filters.
        widths: rows of each joint that its band resolves (n,).

    Returns:
        The free torque of each joint.
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
    """Whitens functions (m, k) of a stretch that starts at a row of a log; returns the first white row and the rows."""
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
    """Returns a short stretch as it is, and both ends of a long one, where the joint stops or breaks away."""
    if stop - start <= longest:
        return [(start, stop)]
    ends = [(max(edge - beside, 0), min(edge + beside, rows)) for edge in (start, stop) if 0 < edge < rows]
    return ends
