"""Estimate of the torque noise from the residual of a model: spectrum, levels, correlation, bursts and outliers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from estimation.diagnosis.calibration import (
    BURST_SIGMAS,
    IMPACT_TIME,
    MAX_BURST_SHARE,
    MAX_MOTION_ERROR,
    MAX_REVERSAL_ERROR,
    MAX_ROW_SIGMAS,
    MIN_PUSH_TIME,
    SPIKE_SIGMAS,
)
from estimation.diagnosis.noise_models.frequency_bands import find_bands, unbiased_frequencies
from estimation.diagnosis.noise_models.masked_rows import find_masked_rows
from estimation.diagnosis.noise_models.noise_nuisance_basis import NuisanceProjection
from estimation.diagnosis.noise_models.noise_spectrum import (
    WITH_NUISANCE,
    WITHOUT_NUISANCE,
    fit_noise_process,
    remove_lines,
)
from estimation.diagnosis.noise_models.whitening import Whitening, free_columns
from estimation.diagnosis.recordings.recording import Recording, rest_rows
from estimation.uncertainty.quantiles import NORMAL_MEDIAN, robust_deviation
from robots.common.arrays import Array

# Standard deviations at which innovations are clipped; t-distributed noise of five degrees of freedom rarely exceeds
# them.
WINSOR = 5.0
# Share of a band's cut-off up to which the band is flat.
INSIDE = 0.75
# Fewest periods in the logs of the lowest frequency that is used.
FEWEST = 4.0
# Shrinkage of a log's noise level towards that of all logs: the latter counts like this many frequencies.
FEW = 20.0
QUIETEST = 1e-3
# Fewest known rows of a joint from which the high-frequency noise is estimated.
FEWEST_ROWS = 100
# Masked stretches of up to `SHORT` rows are always short. If fewer than the share `ENOUGH` of the rows would remain,
# interpolated rows count, too.
SHORT, ENOUGH = 8, 0.3


def estimate_whitening(
    recording: Recording,
    residual: Array,
    parameters: int,
    inertia: Array,
    share: float = MAX_MOTION_ERROR,
    spared: Sequence[Array] = (),
) -> Whitening:
    """Estimates the noise of each joint and builds the filters that whiten it.

    The noise is the residual of the model. If an effect is found later, it is subtracted and the noise estimated anew.
    Differences between repetitions of a motion are not used: they contain no error that repeats, even of a model that
    is right but for a few rows. `residual_shares` uses them instead.

    Args:
        recording: the data.
        residual: torque minus model (N, n) [N m or N].
        parameters: number of parameters fitted to it, which absorb some of the noise.
        inertia: torque on each joint per acceleration of each (n, n) [kg m2]; it turns acceleration errors into torque.
        share: largest power of the acceleration errors in the bands, as a share of the torque noise.
        spared: nuisance columns of each joint (N, k), projected out before the noise is measured.

    Returns:
        The whitening filters, with bands, masked rows, and weights of the rows.
    """
    colour = WITH_NUISANCE if len(spared) else WITHOUT_NUISANCE
    longest = rest_rows(recording.step)
    rests = find_masked_rows(recording.sign_unknown, recording.starts, longest)
    # Where the direction of motion is unknown, the residual is not noise.
    gaps = find_masked_rows(recording.sign_unknown, recording.starts)
    bridged = np.column_stack([gaps.bridged(column, j) for j, column in enumerate(residual.T)])
    pieces = [bridged[run] for run in recording.runs]
    moving = np.array([1.0 - len(rows) / len(residual) for rows, *_ in rests.bridges])
    highest = unbiased_frequencies(recording, inertia, bridged, moving) if share == MAX_MOTION_ERROR else np.inf
    known = [~recording.sign_unknown[run] for run in recording.runs]
    bands = find_bands(recording, inertia, _density(pieces, recording.step, known), share, highest)
    pieces = [
        np.column_stack([band.passed(column) for band, column in zip(bands, piece.T, strict=True)]) for piece in pieces
    ]
    stride = bands[0].stride
    step = recording.step * stride
    cutoffs = np.array([band.cutoff for band in bands])
    widths = 1 / (2 * cutoffs * recording.step)
    resting = rests.resting(recording.starts, len(residual), stride, int(np.ceil(1.5 * widths.max())) + 2)
    measured = ~resting if colour.held else _measured(recording, stride, widths, ~resting)
    spared = [gaps.bridged(X, j) for j, X in enumerate(spared)]
    beside = NuisanceProjection(spared, bands, recording.runs, measured)
    left = beside.left(pieces)
    if (moments := find_bursts(left, measured, step)).any():
        measured &= ~moments
        beside = NuisanceProjection(spared, bands, recording.runs, measured)
        left = beside.left(pieces)
    counts, pieces = np.maximum(measured.sum(axis=0), 1).astype(float), left
    slowest, fastest = max(colour.flat, FEWEST / (sum(map(len, pieces)) * step)), INSIDE * cutoffs
    slowest = slowest if slowest <= WITHOUT_NUISANCE.flat else 0.0
    period = next((cycle.period for cycle in recording.cycles if cycle is not None), None)
    noise = fit_noise_process(pieces, step, counts, parameters, (slowest, fastest), beside, period, colour)
    levels = None
    if len(pieces) > 1:
        counted = [rows.sum(axis=0) for rows in np.split(~resting, np.cumsum([len(piece) for piece in pieces])[:-1])]
        levels = _levels([noise.whitened(piece) for piece in pieces], counted, step, slowest, fastest)
        pieces = [piece / level for piece, level in zip(pieces, levels, strict=True)]
        noise = fit_noise_process(pieces, step, counts, parameters, (slowest, fastest), beside, period, colour)
    trimmed = max(len(a) for a in noise.coefficients)
    innovations = np.concatenate([noise.whitened(piece)[min(trimmed, len(piece) // 2) :] for piece in pieces])
    # Innovations have equal power at all frequencies. Frequencies below the window contain effects, and those above the
    # band contain nothing; both are left out.
    size = next_fast_len(len(innovations), real=True)
    spectrum = np.fft.rfft(innovations, size, axis=0)
    f = np.fft.rfftfreq(size, step)
    inside = (f[:, None] >= slowest) & (f[:, None] < fastest)
    power = remove_lines(np.abs(spectrum) ** 2, f[1], period)
    spectrum *= np.sqrt(power) / np.maximum(np.abs(spectrum), np.finfo(float).tiny)
    spectrum[~inside] = 0.0
    power = np.where(inside, power / beside.kept(size, counts), 0.0)
    scale = np.maximum(np.sqrt(power.sum(axis=0) / np.maximum(inside.sum(axis=0), 1) / counts), 1e-12)
    # The correlation of joints comes from the frequencies that are known for all of them.
    spectrum[~inside.all(axis=1)] = 0.0
    shared = _unit(spectrum, size)
    correlation = np.atleast_2d(shared.T @ shared / len(shared))
    # Few rows yield random correlations. Shrinkage towards none keeps the matrix well conditioned.
    correlation = 0.95 * correlation + 0.05 * np.eye(residual.shape[1])
    plain = Whitening(
        coefficients=noise.coefficients,
        scale=scale,
        precision=np.asarray(np.linalg.inv(correlation), dtype=np.float64),
        starts=recording.starts,
        masked=gaps,
        bands=bands,
        levels=levels,
    )
    free = free_columns(recording.sign_unknown, longest, plain, widths.tolist())
    plain = replace(plain, masked=replace(gaps, free=free))
    white_left = np.where(resting, np.nan, np.abs(plain.all(residual)))
    level = np.array([robust_deviation(x) if np.isfinite(x).any() else 1.0 / NORMAL_MEDIAN for x in white_left.T])
    weights = np.minimum(1.0, MAX_ROW_SIGMAS * np.maximum(level, 0.1) / np.maximum(white_left, 1e-12))
    weights[_pushed(weights < 1.0, recording, stride, cutoffs)] = 1.0
    return replace(plain, weights=np.where(resting, 0.0, weights))


def _measured(recording: Recording, stride: int, widths: Array, moving: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Marks decimated rows (M, n) that show the noise: not interpolated stretches longer than the band resolves.

    Such a stretch repeats the noise of two samples, with all frequencies beyond the band, for its whole length.
    """
    result = moving.copy()
    for j, width in enumerate(widths):
        bridges = find_masked_rows(recording.sign_unknown[:, [j]], recording.starts, max(SHORT, round(width)))
        held = bridges.resting(recording.starts, len(recording), stride, int(np.ceil(width)))[:, 0]
        if np.sum(moving[:, j] & ~held) > ENOUGH * np.sum(moving[:, j]):
            result[:, j] &= ~held
    return result


def _pushed(outside: NDArray[np.bool_], recording: Recording, stride: int, cutoffs: Array) -> NDArray[np.bool_]:
    """Marks white rows (N, n) that are outliers together, away from the joint's reversals: such a push is an effect.

    They must last longer than an acceleration jump that the band spreads: 3/4 of a period of its cut-off (n,) [Hz] to
    either side.
    """
    step, reach = recording.step * stride, round(IMPACT_TIME / recording.step)
    crowded = np.empty_like(outside)
    for j, cutoff in enumerate(cutoffs):
        width = max(3, round(max(MIN_PUSH_TIME, 1.5 / cutoff) / step))
        crowded[:, j] = uniform_filter1d(outside[:, j].astype(float), width) >= 0.5
    near = [
        maximum_filter1d(recording.sign_unknown[run].astype(np.int8), 2 * reach + 1, axis=0)[::stride]
        for run in recording.runs
    ]
    return outside & crowded & (np.concatenate(near) == 0)


def _levels(
    white: Sequence[Array], counts: Sequence[NDArray[np.intp]], step: float, slowest: float, fastest: Array
) -> Array:
    """Estimates the noise level of each log over that of all logs (logs, n), from whitened residuals (N, n) of each.

    Only the upper half of the known frequencies is used, since an effect that acts in one log only is slow. The level
    is shrunk towards one for a log of few frequencies, or of few rows in which a joint moves (n,).
    """
    powers, numbers = np.empty((2, len(white), len(fastest)))
    for i, (rows, counted) in enumerate(zip(white, counts, strict=True)):
        f = np.fft.rfftfreq(len(rows), step)[:, None]
        inside = (f >= np.maximum(slowest, fastest / 2)) & (f < fastest)
        # A joint at rest has no noise, and accordingly fewer frequencies.
        numbers[i] = inside.sum(axis=0) * counted / len(rows)
        powers[i] = (np.abs(np.fft.rfft(rows, axis=0)) ** 2 * inside).sum(axis=0) / len(rows)
    mean = np.maximum(powers.sum(axis=0) / np.maximum(numbers.sum(axis=0), 1), 1e-300)
    ratio = np.maximum(powers / np.maximum(numbers, 1) / mean, QUIETEST**2)
    return np.asarray(np.where(numbers > 0, ratio ** (0.5 * numbers / (numbers + FEW)), 1.0))


def _unit(spectrum: NDArray[np.complex128], rows: int) -> Array:
    """Returns the signals (N, n) of spectra with outliers clipped, zero mean and unit variance."""
    white = np.fft.irfft(spectrum, rows, axis=0)
    white = np.clip(white / np.maximum(white.std(axis=0), 1e-12), -WINSOR, WINSOR)
    white -= white.mean(axis=0)
    return np.asarray(white / np.maximum(white.std(axis=0), 1e-12))


def quiet_joints(recording: Recording, residual: Array, inertia: Array) -> NDArray[np.bool_]:
    """Finds joints (n,) whose acceleration errors at reversals are small against the torque noise.

    Args:
        recording: the data.
        residual: torque minus model (N, n) [N m or N].
        inertia: torque on each joint per acceleration of each (n, n) [kg m2].

    Returns:
        Flags (n,).
    """
    density = _density([residual[run] for run in recording.runs], recording.step)
    # Standard deviation of single samples at the full rate: an acceleration jump lasts for few of them.
    noise = np.sqrt(density * recording.stride / (2 * recording.step))
    return np.asarray(np.diag(inertia) * recording.reversal_acceleration_error < MAX_REVERSAL_ERROR * noise)


def _density(pieces: Sequence[Array], step: float, known: Sequence[NDArray[np.bool_]] | None = None) -> Array:
    """Estimates the power density of high-frequency noise (n,), from second differences in rows that are `known`."""
    # A second difference of white noise of variance s^2 has the variance 6 s^2, and slow noise cancels. The median of
    # squares ignores the rare jumps at reversals.
    squares = np.concatenate([np.diff(piece, 2, axis=0) ** 2 for piece in pieces])
    if known is not None:
        # Interpolated rows are free of noise. They are most rows of a joint that mostly rests.
        inner = np.concatenate([rows[:-2] & rows[1:-1] & rows[2:] for rows in known])
        squares[~inner & (inner.sum(axis=0) >= FEWEST_ROWS)] = np.nan
    return np.asarray(np.nanmedian(squares, axis=0) / NORMAL_MEDIAN**2 / 6 * 2 * step)


WIDTHS = (0.3, 1.0)
"""Durations [s] over which a residual is averaged: as long as a push, and longer than spikes of noise."""


def find_bursts(pieces: Sequence[Array], measured: NDArray[np.bool_], step: float) -> NDArray[np.bool_]:
    """Marks rows (M, n) in bursts, joint by joint.

    A row is in a burst if a moving average over it is far larger than usual.

    Args:
        pieces: residual of each log (N, n) [N m or N], zero where it is not measured.
        measured: rows of all logs that count (M, n).
        step: time between rows [s].

    Returns:
        Flags (M, n); none for a joint whose bursts are too frequent to be exceptions.
    """
    marked = np.zeros_like(measured)
    rows_of = np.abs(np.concatenate(pieces))
    pairs = zip(rows_of.T, measured.T, strict=True)
    most = SPIKE_SIGMAS * np.array([robust_deviation(x[rows]) if rows.any() else 0.0 for x, rows in pairs])
    pieces = [np.clip(piece, -most, most) for piece in pieces]
    for width in WIDTHS:
        size = max(1, round(width / step))
        means = np.concatenate([uniform_filter1d(piece, size, axis=0, mode="constant") for piece in pieces])
        for j, (mean, counts) in enumerate(zip(np.abs(means).T, measured.T, strict=True)):
            if counts.any():
                far = mean > BURST_SIGMAS * robust_deviation(mean[counts])
                # A large average marks all rows that it covers.
                marked[:, j] |= maximum_filter1d(far.astype(np.int8), size) > 0
    marked &= measured
    seldom = marked.sum(axis=0) <= MAX_BURST_SHARE * measured.sum(axis=0)
    return np.asarray(marked & seldom)
