"""The colour of the torque noise, from what changes between repetitions or from the residual, and its removal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.signal import firwin, lfilter, upfirdn
from scipy.sparse import csc_matrix, hstack
from scipy.sparse.csgraph import connected_components

from estimation.diagnosis.states import Recording, spans
from estimation.uncertainty.autoregressive import HIGHEST_ORDER, autocovariance, fit_noise

Array = NDArray[np.float64]

# Share of the variance added to the diagonal: without it the whitening would amplify an empty band.
LOADING = 0.01
# Innovations beyond so many standard deviations count as this many: a level that tails of five degrees pass rarely.
WINSOR = 5.0
# The flat part of the band, as a share of its cut-off.
INSIDE = 0.75
# Longest memory of the noise model [s]: with more, it would take slow effects for noise.
MEMORY = 0.2
# Functions of one gap that the band cannot tell apart count once.
DISTINCT = 1e-4
# White rows beyond so many standard deviations weigh as if they were there (Huber): kicks that no filter undoes.
HUBER = 3.5
# From fewer repetitions nothing is said of what repeats.
FEWEST = 3
# The error of the acceleration may make this share of the torque noise's power; above, both are filtered away.
SHARE = 0.2
# A joint that has not moved on for so long [s] is at rest.
LONG_GAP = 0.3
# Slowest low-pass [Hz], fastest as a share of the sampling rate: above, a sampled kick is no longer what it was.
SLOWEST, FASTEST = 4.0, 0.2
TRANSITION = 0.25  # of the low-pass, as a share of its cut-off


@dataclass(frozen=True, eq=False)
class Gaps:
    """Rows in which a joint's direction of motion is not known, nor then the sign of its friction.

    Short ones are given a torque of their own each, as many numbers as the band lets through: white columns that are
    projected out of torque and hypotheses alike. Long ones, a joint at rest, are bridged by straight lines in both.

    Attributes:
        bridges: per joint the rows, those before and after that count, and the weight of the latter.
        free: per joint orthonormal white columns (N, f) of the short gaps.
    """

    bridges: tuple[tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp], Array], ...]
    free: tuple[csc_matrix, ...]

    def bridged(self, series: Array, joint: int) -> Array:
        """Replaces the rows of long gaps in columns (N,) or (N, k) of a joint, counted from 0."""
        rows, before, after, weight = self.bridges[joint]
        if not len(rows):
            return series
        result = series.copy()
        w = weight[:, *(None,) * (series.ndim - 1)]
        result[rows] = (1 - w) * series[before] + w * series[after]
        return result

    def freed(self, white: Array, joint: int) -> Array:
        """Projects the short gaps' torques out of white columns of a joint."""
        if joint >= len(self.free) or not self.free[joint].shape[1]:
            return white
        own = self.free[joint]
        return np.asarray(white - own @ (own.T @ white))


def find_gaps(unsure: NDArray[np.bool_], starts: tuple[int, ...], longest: int = 0) -> Gaps:
    """Makes bridges over stretches of rows (N, n) longer than `longest`, none from one log to another."""
    bridges = []
    for column in unsure.T:
        flags = np.zeros_like(column)
        for start, stop in spans(column):
            if stop - start > longest:
                flags[start:stop] = True
        pieces = []
        for start, stop in pairwise((*starts, len(column))):
            rows, good = np.flatnonzero(flags[start:stop]), np.flatnonzero(~flags[start:stop])
            if not len(rows) or not len(good):
                continue  # a joint that stands all the time: nothing to bridge from
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
    return Gaps(tuple(bridges), ())


def free_columns(unsure: NDArray[np.bool_], longest: int, whitening: Whitening, width: float) -> tuple[csc_matrix, ...]:
    """Builds the white columns of the short gaps: polynomials over each, one for every `width` rows and one more.

    Each is whitened where it is not zero only, so that a long log costs no more a gap than a short one.
    """
    result = []
    beside = int(np.ceil(1.5 * width)) + 2
    for j, column in enumerate(unsure.T):
        rows, values, at, first_row = [], [], [], 0
        count = 0
        for run_start, run_stop in pairwise((*whitening.starts, len(column))):
            for gap in spans(column[run_start:run_stop]):
                for start, stop in _short(*gap, longest, beside, run_stop - run_start):
                    x = np.linspace(-1, 1, stop - start) if stop - start > 1 else np.zeros(1)
                    number = min(stop - start, int(np.ceil((stop - start) / width)) + 1)
                    shapes = np.asarray(np.polynomial.legendre.legvander(x, number - 1), dtype=np.float64)
                    row, white = _white_gap(whitening, j, start, shapes, run_stop - run_start)
                    norms = np.linalg.norm(white, axis=0)
                    white = white / np.where(norms > 0, norms, 1.0)
                    rows.append(np.repeat(first_row + row + np.arange(len(white)), number))
                    at.append(np.tile(np.arange(count, count + number), len(white)))
                    values.append(white.ravel())
                    count += number
            first_row += -(-(run_stop - run_start) // whitening.band.stride)
        if not values:
            result.append(csc_matrix((first_row, 0)))
            continue
        entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(at)))
        result.append(_orthonormal_blocks(csc_matrix(entries, shape=(first_row, count))))
    return tuple(result)


def _white_gap(whitening: Whitening, joint: int, start: int, shapes: Array, rows: int) -> tuple[int, Array]:
    """Whitens functions of a gap (m, k) that begins at a row of a log: the first white row, and the white rows."""
    band = whitening.band
    half, stride = len(band.taps) // 2, band.stride
    taps = np.concatenate([[1.0], -whitening.coefficients[joint]]) / whitening.scale[joint]
    low = max(0, start - half - stride) // stride * stride
    high = min(rows, start + len(shapes) + half + (len(taps) + 1) * stride)
    segment = np.zeros((high - low, shapes.shape[1]))
    segment[start - low : start - low + len(shapes)] = shapes
    white = lfilter(taps, [1.0], band.passed(segment).T).T
    first = low // stride
    lead = max(0, min(len(taps) - 1 - first, len(white)))
    white[:lead] *= np.linspace(0, 1, len(taps))[1 + first : 1 + first + lead, None]
    return first, white


def _orthonormal_blocks(columns: csc_matrix) -> csc_matrix:
    """Makes sparse columns orthonormal, gap by gap where gaps do not touch each other's rows."""
    gram = (columns.T @ columns).tocsr()
    _, labels = connected_components(gram, directed=False)
    order = np.argsort(labels, kind="stable")
    blocks = []
    for members in np.split(order, np.flatnonzero(np.diff(labels[order])) + 1):
        values, vectors = np.linalg.eigh(gram[members][:, members].toarray())
        kept = values > DISTINCT * values[-1]
        blocks.append(columns[:, members] @ csc_matrix(vectors[:, kept] / np.sqrt(values[kept])))
    return hstack(blocks, format="csc")


def _short(start: int, stop: int, longest: int, beside: int, rows: int) -> list[tuple[int, int]]:
    """A short gap as it is; of a long one both ends, where the joint came to rest or broke loose with a kick."""
    if stop - start <= longest:
        return [(start, stop)]
    ends = [(max(edge - beside, 0), min(edge + beside, rows)) for edge in (start, stop) if 0 < edge < rows]
    return ends


def orthonormal(matrix: Array, faint: float) -> Array:
    """Gives an orthonormal basis of the columns, directions below a share `faint` of the largest left out."""
    norms = np.linalg.norm(matrix, axis=0)
    scaled = matrix[:, norms > 0] / norms[norms > 0]
    if not scaled.shape[1]:
        return np.zeros((len(matrix), 0))
    Q, R = np.linalg.qr(scaled)
    U, s, _ = np.linalg.svd(R)
    kept: Array = Q @ U[:, s > faint * s[0]]
    return kept


@dataclass(frozen=True, eq=False)
class Band:
    """The frequencies in which motion is known: torque and all columns are low-passed alike, and thinned.

    Friction that turns round kicks a joint faster than its encoder can tell. Where both sides of the equation are
    filtered alike, what is lost on one side is lost on the other.

    Attributes:
        taps: of the filter, an odd number; empty for none.
        stride: rows that become one.
        cutoff: [Hz].
    """

    taps: Array
    stride: int
    cutoff: float

    def passed(self, series: Array) -> Array:
        """Filters and thins rows (N,) or (N, k) of one log."""
        if not len(self.taps):
            return series[:: self.stride]
        half = len(self.taps) // 2
        # Zeros before the log put the filter's middle on a row that is kept.
        lead = -half % self.stride
        # Filters run along the last axis: along the first of several columns they would be five times as slow.
        rows = np.atleast_2d(np.ascontiguousarray(series.T))
        padded = np.concatenate([np.zeros((len(rows), lead)), rows], axis=1)
        thin = upfirdn(self.taps, padded, 1, self.stride, axis=1)
        first = (half + lead) // self.stride
        kept = thin[:, first : first + -(-len(series) // self.stride)]
        return np.asarray(kept[0] if series.ndim == 1 else kept.T)


def find_band(recording: Recording, inertia: Array, torque_density: Array) -> Band:
    """Finds the band: up to where the error of the acceleration, as a torque, comes near the torque noise.

    Args:
        recording: the data.
        inertia: of each joint (n,) [kg m2].
        torque_density: power density of the torque noise at high frequency (n,) [(N m)^2/Hz].
    """
    rate = 1 / recording.step
    error = np.maximum(recording.floor * inertia**2, 1e-300)
    limits = (SHARE * torque_density / error) ** 0.25 / (2 * np.pi)
    cutoff = float(np.clip(limits.min(), min(SLOWEST, FASTEST * rate), FASTEST * rate))
    stride = max(1, int(rate / (2.5 * cutoff)))
    length = int(np.ceil(3.6 * rate / (TRANSITION * cutoff))) | 1
    return Band(firwin(length, cutoff * (1 - TRANSITION / 2), fs=rate, window=("kaiser", 6.0)), stride, cutoff)


@dataclass(frozen=True, eq=False)
class Whitening:
    """A linear filter per joint that makes the noise white, of unit variance, and knows its correlation.

    Attributes:
        coefficients: per joint the prediction filter (p_j,).
        scale: standard deviation of the innovations (n,) [N m or N].
        precision: inverse correlation of the innovations of the joints (n, n).
        starts: rows at which a log begins: the filters start anew.
        innovations: what the noise looks like when white (M, n), for drawing more of it.
        gaps: rows of each joint that do not count.
        band: where motion is known.
        weights: of the white rows (N, n): those that no noise explains count less; None for ones.
    """

    coefficients: tuple[Array, ...]
    scale: Array
    precision: Array
    starts: tuple[int, ...]
    innovations: Array
    gaps: Gaps
    band: Band
    weights: Array | None = None

    def apply(self, series: Array, joint: int) -> Array:
        """Whitens columns (N,) or (N, k) of one joint, counted from 0."""
        series = self.gaps.bridged(series, joint)
        taps = np.concatenate([[1.0], -self.coefficients[joint]]) / self.scale[joint]
        parts = []
        for start, stop in pairwise((*self.starts, len(series))):
            part = self.band.passed(series[start:stop])
            white = lfilter(taps, [1.0], part.T).T.copy()
            # Before the log there is nothing to predict from: its first rows would weigh as if they were shocks.
            lead = min(len(taps) - 1, len(part))
            white[:lead] *= np.linspace(0, 1, len(taps))[1 : lead + 1, *(None,) * (series.ndim - 1)]
            parts.append(white)
        white = self.gaps.freed(np.concatenate(parts) if len(parts) > 1 else parts[0], joint)
        if self.weights is None:
            return white
        return white * self.weights[:, joint, *(None,) * (series.ndim - 1)]

    def all(self, series: Array) -> Array:
        """Whitens (N, n) or (N, n, k)."""
        return np.stack([self.apply(series[:, j], j) for j in range(series.shape[1])], axis=1)

    def draw(self, rows: int, draws: int, rng: np.random.Generator) -> NDArray[np.float32]:
        """Draws white noise (N, n, draws) from the innovations themselves: their tails, their correlation."""
        at = rng.integers(0, len(self.innovations), (rows, draws))
        source = self.innovations.astype(np.float32)
        result = np.empty((rows, source.shape[1], draws), np.float32)
        for j in range(source.shape[1]):
            result[:, j] = source[at, j]
        return result


def estimate_whitening(recording: Recording, residual: Array, parameters: int, inertia: Array) -> Whitening:
    """Estimates the noise.

    It is the residual of the model: what is found in it later is taken out, and the noise estimated anew. Differences
    between repetitions would leave all that repeats out of the noise, also the errors of a model that is right but for
    a few rows: they are for telling what repeats from what does not (`residual_shares`), not for alarms.

    Args:
        recording: the data.
        residual: torque less model (N, n) [N m or N].
        parameters: how many were fitted to it: they have taken some of the noise.
        inertia: of each joint (n,) [kg m2], for the error that the acceleration's makes.
    """
    longest = max(8, round(LONG_GAP / recording.step))
    gaps = find_gaps(recording.unsure, recording.starts, longest)
    bridged = np.column_stack([gaps.bridged(column, j) for j, column in enumerate(residual.T)])
    pieces = [bridged[run] for run in recording.runs]
    band = find_band(recording, inertia, _density(pieces, recording.step))
    pieces = [band.passed(piece) for piece in pieces]
    joints = residual.shape[1]
    counts = np.full(joints, float(sum(len(piece) for piece in pieces)))
    covariances = np.zeros((joints, HIGHEST_ORDER + 1))
    for piece in pieces:
        lags = min(HIGHEST_ORDER, len(piece) - 1)
        for j in range(joints):
            covariances[j, : lags + 1] += autocovariance(piece[:, j], counts[j], lags)
    rows = len(np.concatenate(pieces)) * joints
    highest = int(np.clip(round(MEMORY / (recording.step * band.stride)), 2, HIGHEST_ORDER))
    covariances = covariances[:, : highest + 1]
    covariances *= rows / max(rows - parameters, 0.5 * rows)
    covariances[:, 0] = np.maximum(covariances[:, 0] * (1 + LOADING), np.finfo(float).tiny)
    noise = fit_noise(np.concatenate(pieces), counts, covariances)
    trimmed = max(len(a) for a in noise.coefficients)
    innovations = np.concatenate([noise.whitened(piece)[min(trimmed, len(piece) // 2) :] for piece in pieces])
    # Above the band there is nothing: what is in it has the more power, and that is what hypotheses are measured by.
    power = np.abs(np.fft.rfft(innovations, axis=0)) ** 2
    inside = np.fft.rfftfreq(len(innovations), recording.step * band.stride) < INSIDE * band.cutoff
    density = np.sqrt(power[inside].mean(axis=0) / np.maximum(power.mean(axis=0), 1e-300))
    scale = np.maximum(innovations.std(axis=0) * np.maximum(density, 1.0), 1e-12)
    white = np.clip(innovations / scale, -WINSOR, WINSOR)
    white -= white.mean(axis=0)
    white /= np.maximum(white.std(axis=0), 1e-12)
    correlation = np.atleast_2d(white.T @ white / len(white))
    # Too few rows make correlations of nothing; a tenth towards none keeps the inverse tame.
    correlation = 0.95 * correlation + 0.05 * np.eye(joints)
    plain = Whitening(
        coefficients=noise.coefficients,
        scale=scale,
        precision=np.asarray(np.linalg.inv(correlation), dtype=np.float64),
        starts=recording.starts,
        innovations=white,
        gaps=gaps,
        band=band,
    )
    width = 1 / (2 * band.cutoff * recording.step)
    free = free_columns(recording.unsure, longest, plain, width)
    plain = replace(plain, gaps=replace(gaps, free=free))
    left = np.abs(plain.all(residual))
    level = np.median(left, axis=0) / 0.6745
    return replace(plain, weights=np.minimum(1.0, HUBER * np.maximum(level, 0.1) / np.maximum(left, 1e-12)))


def _density(pieces: Sequence[Array], step: float) -> Array:
    """Power density of the noise (n,) in the upper half of the band, from its fast changes."""
    # A second difference passes white noise of variance s^2 as 6 s^2 and slow noise not at all; the median square
    # stands above the rare kicks at reversals.
    squares = np.concatenate([np.diff(piece, 2, axis=0) ** 2 for piece in pieces])
    return np.asarray(np.median(squares, axis=0) / 0.455 / 6 * 2 * step)


def period_differences(series: Array, period: float, count: int) -> Array:
    """Subtracts the mean over repetitions, and makes up for the variance that goes with it.

    Args:
        series: (M, n).
        period: in samples, not necessarily whole.
        count: of repetitions P.

    Returns:
        (r - mean) sqrt(P / (P - 1)), (M', n).
    """
    return (series - period_mean(series, period, count)) * np.sqrt(count / (count - 1))


def period_mean(series: Array, period: float, count: int) -> Array:
    """Gives the mean over repetitions, repeated (M, n); rows of a period are matched to the nearest sample."""
    rows = len(series)
    samples = max(1, round(period))
    phase = np.floor(np.mod(np.arange(rows) + 1e-6, period) / period * samples).astype(int) % samples
    hits = np.bincount(phase, minlength=samples)
    mean = np.stack([np.bincount(phase, column, samples) for column in series.T], axis=1) / np.maximum(hits, 1)[:, None]
    return np.asarray(mean[phase])
