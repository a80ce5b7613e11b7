"""The colour of noise: an autoregressive process, from a spectrum that is known in a window alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len

from estimation.diagnosis.noise_models.noise_nuisance_basis import NuisanceProjection
from estimation.diagnosis.noise_models.spectral_lines import remove_lines
from estimation.uncertainty.autoregressive import HIGHEST_ORDER, Noise, fit_noise, levinson

Array = NDArray[np.float64]

# Share of the variance added to the diagonal: without it the whitening would amplify an empty band.
LOADING = 0.01
# Of the noise's process: fewer coefficients would not tell a colour from white, however seldom rows are.
LOWEST_ORDER = 4
ROUNDS = 20


@dataclass(frozen=True)
class SpectrumSettings:
    """How the colour of noise is told.

    Attributes:
        flat: below this frequency [Hz] noise is flat: what stands out there is an effect's, and not counted.
        memory: longest of the noise model [s].
        rows: a coefficient at least.
        times: the model's order is so many times the one that predicts best.
        held: whether rows in bridges count that are longer than what the band lets through.
    """

    flat: float
    memory: float
    rows: int
    times: int
    held: bool


# Beside free functions all of the memory is used: an order that predicts best misses much of what noise slower than a
# second has, and slow effects are measured against that. Where nothing is spared it would take slow effects for noise.
WITHOUT_LOW_FREQUENCIES = SpectrumSettings(flat=0.15, memory=1.0, rows=100, times=HIGHEST_ORDER, held=False)
ALL_FREQUENCIES = SpectrumSettings(flat=1.0, memory=0.2, rows=1, times=1, held=True)


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
    """Fits the noise by its spectrum within a window, and lets the model say what is outside.

    What an effect leaves in the residual is slow, as motion is; taken for noise it would hide itself. Above the window
    is the edge of the band. Outside, the spectrum is what the fitted process has there, again and again until it stays
    (a Yule-Walker fit of data that are missing).

    Args:
        pieces: residual of each log (N, n), `step` [s] a row.
        step: the sample period [s].
        counts: rows of each joint that are no bridge over a time at rest (n,).
        parameters: how many were fitted to the residual: they have taken some of the noise.
        window: the lowest frequency [Hz], and the highest of each joint (n,).
        beside: what was taken out of the pieces.
        period: of the motion [s]; None where it does not repeat.
        colour: settings of the estimate.
    """
    rows, joints = sum(map(len, pieces)), pieces[0].shape[1]
    longest = np.minimum(colour.memory / step, counts / colour.rows)
    orders = np.clip(longest, LOWEST_ORDER, HIGHEST_ORDER).astype(int)
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
    """Gives one joint's covariances (highest + 1,) from its power (F,), known in a window alone, of `size` rows.

    What is outside is what a process of so many `times` the order that predicts best has there.
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
