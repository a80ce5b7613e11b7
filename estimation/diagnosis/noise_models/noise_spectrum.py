"""Coloured noise as an autoregressive process, fitted to a spectrum without its lines in a window of frequencies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.fft import next_fast_len
from scipy.ndimage import median_filter

from estimation.diagnosis.calibration import LINE_FALSE_ALARM
from estimation.diagnosis.noise_models.noise_nuisance_basis import NuisanceProjection
from estimation.uncertainty.autoregressive import HIGHEST_NOISE_ORDER, Noise, fit_noise, levinson
from robots.common.arrays import Array

# Share of the variance added to the diagonal: otherwise whitening would amplify an empty band.
LOADING = 0.01
# Lowest order of the process: fewer coefficients cannot describe coloured noise, however low the sampling rate.
LOWEST_ORDER = 4
ROUNDS = 20


@dataclass(frozen=True)
class SpectrumSettings:
    """Settings of the noise estimate.

    Attributes:
        flat: frequency [Hz] below which noise is taken to be flat; a higher spectrum there is that of an effect.
        memory: longest memory of the noise model [s].
        rows: least number of rows per coefficient.
        times: order of the model over the order that predicts best.
        held: whether interpolated stretches longer than the band resolves count.
    """

    flat: float
    memory: float
    rows: int
    times: int
    held: bool


# With nuisance functions, the whole memory is used. The order that predicts best misses much of the noise slower than a
# second, against which slow effects are tested. Without nuisance functions, such an order would take slow effects for
# noise.
WITH_NUISANCE = SpectrumSettings(flat=0.15, memory=1.0, rows=100, times=HIGHEST_NOISE_ORDER, held=False)
WITHOUT_NUISANCE = SpectrumSettings(flat=1.0, memory=0.2, rows=1, times=1, held=True)


def fit_noise_process(
    pieces: Sequence[Array],
    step: float,
    counts: Array,
    parameters: int,
    window: tuple[float, Array],
    beside: NuisanceProjection,
    period: float | None,
    colour: SpectrumSettings,
) -> Noise:
    """Fits the noise process of each joint to its spectrum within a window of frequencies.

    Effects leave a slow residual, as slow as motion. Taken for noise, it would hide them. Frequencies below the window
    are therefore not used, and those above it are at the edge of the band. Outside the window the spectrum is replaced
    by that of the fitted process, and the fit is repeated (a Yule-Walker fit with missing data).

    Args:
        pieces: residual of each log (N, n) [N m or N].
        step: sample period [s].
        counts: rows of each joint that count, without interpolated times at rest (n,).
        parameters: number of parameters fitted to the residual, which absorb some of the noise.
        window: lowest frequency [Hz], and highest frequency of each joint (n,) [Hz].
        beside: the nuisance projection that was applied to the pieces.
        period: period of the motion [s]; None if it does not repeat.
        colour: settings of the estimate.

    Returns:
        The noise process of each joint.
    """
    rows, joints = sum(map(len, pieces)), pieces[0].shape[1]
    longest = np.minimum(colour.memory / step, counts / colour.rows)
    orders = np.clip(longest, LOWEST_ORDER, HIGHEST_NOISE_ORDER).astype(int)
    size = next_fast_len(max(map(len, pieces)) + int(orders.max()) + 1, real=True)
    power = sum(np.abs(np.fft.rfft(piece, size, axis=0)) ** 2 for piece in pieces) / counts
    power = remove_lines(power / beside.kept(size, counts), 1 / (size * step), period)
    power = power * rows * joints / max(rows * joints - parameters, 0.5 * rows * joints)
    covariances = [
        _covariance(power[:, j], size, step, counts[j], (window[0], float(window[1][j])), orders[j], colour.times)
        for j in range(joints)
    ]
    return fit_noise(np.concatenate(pieces), counts, covariances, colour.times)


def _covariance(
    power: Array, size: int, step: float, count: float, window: tuple[float, float], highest: int, times: int
) -> Array:
    """Computes a joint's autocovariance (highest + 1,) from power (F,) of `size` rows, known in a window only.

    Power outside the window is that of a process whose order is `times` the one that predicts best.
    """
    f = np.fft.rfftfreq(size, step)
    power = power.copy()

    def covariance() -> Array:
        result = np.fft.irfft(power, size)[: highest + 1]
        result[0] = max(result[0] * (1 + LOADING), np.finfo(float).tiny)
        return np.asarray(result)

    known = (f >= window[0]) & (f < window[1])
    if known.any() and not known.all():
        places = np.flatnonzero(known)
        quarter = max(1, len(places) // 4)
        power[f < window[0]] = power[places[:quarter]].mean()
        power[f >= window[1]] = power[places[-quarter:]].mean()
        lags = np.exp(-2j * np.pi * step * f[~known, None] * np.arange(1, highest + 1))
        for _ in range(ROUNDS):
            a, variance = levinson(covariance(), count, times)
            power[~known] = variance / np.abs(1.0 - lags[:, : len(a)] @ a) ** 2
    return covariance()


# Frequencies [Hz] on either side of a line from which the noise there is estimated, and the fewest spectral bins.
BESIDE, FEWEST = 1.0, 41


def remove_lines(power: Array, width: float, period: float | None = None) -> Array:
    """Replaces spectral lines by the level of the noise about them.

    The power of noise at one frequency is exponentially distributed about its density. A running median estimates that
    density without the lines. Errors of a model have lines at the harmonics of a periodic motion; these lines stay. The
    power stays unchanged if the log is too short to separate lines from coloured noise.

    Args:
        power: power at each frequency, from zero on (F, n).
        width: frequency step [Hz].
        period: period of the motion [s]; None if it does not repeat.

    Returns:
        The power (F, n), with lines and their leakage replaced by the noise level.
    """
    reach = int(2 * BESIDE / width) | 1
    if not FEWEST <= reach < len(power):
        return power
    waves = np.arange(len(power)) * width * (period or 0.0)
    between = np.abs(waves - np.round(waves)) > 0.5 * width * period if period else np.ones(len(power), dtype=bool)
    # One column at a time: the one-dimensional filter is about eighty times as fast.
    level = np.stack([median_filter(own, reach, mode="reflect") for own in power.T], axis=1) / np.log(2)
    result = np.array(power, dtype=float)
    for j in range(power.shape[1]):
        lines = between & (power[:, j] > np.log(len(power) / LINE_FALSE_ALARM) * level[:, j])
        for place in np.flatnonzero(lines):
            # The leakage of a line between two bins falls with the square of the distance.
            spread = int(0.5 * np.sqrt(power[place, j] / max(level[place, j], np.finfo(float).tiny)))
            near = slice(max(place - spread, 0), place + spread + 1)
            result[near, j] = np.where(between[near], level[near, j], result[near, j])
    return result
