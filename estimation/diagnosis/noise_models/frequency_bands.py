"""Usable frequency band of each joint: torque and columns pass the same low-pass, and are decimated."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Any, Literal, overload

import numpy as np
import scipy.fft
from numpy.typing import NDArray
from scipy.signal import firwin, welch

from estimation.diagnosis.calibration import MAX_BIAS_CHI2, MAX_MOTION_ERROR
from estimation.diagnosis.recordings.recording import Recording
from robots.common.arrays import Array

Small = NDArray[np.float32]

# Length of the windows of spectra [s], and the fewest rows of one. Power densities below `QUIETEST` are zero.
WINDOW, FEWEST, QUIETEST = 8.0, 16, 1e-100
# Lowest cut-off [Hz], and the highest as a share of the sampling rate: above it, sampling distorts acceleration jumps.
SLOWEST, FASTEST = 4.0, 0.2
TRANSITION = 0.25  # width of the transition band, as a share of the cut-off
# Tolerance by which a stride may fall below a whole number: sample periods are rounded.
WHOLE = 1e-6


@dataclass(frozen=True, eq=False)
class Band:
    """Low-pass and decimation of one joint's torque and columns.

    Coulomb friction makes the acceleration jump faster than an encoder can resolve. If both sides of the equation pass
    the same filter, they lose the same part.

    Attributes:
        taps: coefficients of the filter, an odd number; empty for none.
        stride: decimation: rows of the log per row kept.
        cutoff: cut-off frequency [Hz].
    """

    taps: Array
    stride: int
    cutoff: float

    @overload
    def passed(
        self,
        series: Array,
        after: Array | None = None,
        *,
        starts: tuple[int, ...] = (0,),
        single: Literal[False] = False,
    ) -> Array: ...
    @overload
    def passed(
        self, series: Array, after: Array | None = None, *, starts: tuple[int, ...] = (0,), single: Literal[True]
    ) -> Small: ...
    def passed(
        self, series: Array, after: Array | None = None, *, starts: tuple[int, ...] = (0,), single: bool = False
    ) -> Array | Small:
        """Filters and decimates rows (N,) or (N, k) of logs, each log by itself.

        Columns that are contiguous in memory (Fortran order) are filtered several times as fast.

        Args:
            series: the rows.
            after: coefficients (p,) of a filter for the decimated rows; None for none.
            starts: first row of each log.
            single: computes in single precision, twice as fast, with rounding errors of 1e-7 of the largest value.

        Returns:
            The decimated rows (M,) or (M, k).
        """
        kind: type = np.float32 if single else np.float64
        runs = [slice(*run) for run in pairwise((*starts, len(series)))]
        lengths = [-(-(run.stop - run.start) // self.stride) for run in runs]
        if not len(self.taps) and after is None:
            thinned = [series[run][:: self.stride] for run in runs]
            return (thinned[0] if len(runs) == 1 else np.concatenate(thinned)).astype(kind, copy=False)
        if not series.size:  # a joint that does not move has no columns
            return np.zeros((sum(lengths), *series.shape[1:]), dtype=kind)
        columns = series.T if series.ndim > 1 else series[None]
        # Zeros between logs, as many as the filters reach.
        size, response, reach = _response(self, sum(lengths), len(runs), 0 if after is None else len(after))
        places = np.cumsum([0, *lengths[:-1]]) + reach * np.arange(len(runs))
        apart: Array | Small = np.zeros((len(columns), size), dtype=kind)
        for run, place in zip(runs, places * self.stride, strict=True):
            apart[:, place : place + run.stop - run.start] = columns[:, run]
        spectrum = scipy.fft.rfft(apart, axis=1, overwrite_x=True)
        if response is not None:
            spectrum *= response.astype(kind, copy=False)
        short = size // self.stride
        spectrum = _decimated(spectrum, size, short)
        if after is not None:
            spectrum *= scipy.fft.rfft(after, short).astype(spectrum.dtype, copy=False)
        thin = scipy.fft.irfft(spectrum, short, axis=1, overwrite_x=True)
        result: Array | Small = np.empty((len(columns), sum(lengths)), dtype=kind)
        first = 0
        for place, length in zip(places, lengths, strict=True):
            result[:, first : first + length] = thin[:, place : place + length]
            first += length
        return result[0] if series.ndim == 1 else result.T


def _decimated(spectrum: NDArray[Any], size: int, short: int) -> NDArray[Any]:
    """Keeps one row in `size / short`: averages the half spectra (k, size // 2 + 1) that alias onto each other."""
    if size == short:
        return spectrum
    half, result = short // 2, spectrum[:, : short // 2 + 1].copy()
    for start in range(short, size // 2 + 1, short):
        part = spectrum[:, start : start + half + 1]
        result[:, : part.shape[1]] += part
    # Those of negative frequencies are the conjugates of the positive ones.
    for stop in range(short, (size - 1) // 2 + half + 1, short):
        part = spectrum[:, stop - half : min(stop, (size - 1) // 2) + 1]
        result[:, half + 1 - part.shape[1] :] += part[:, ::-1].conj()
    result *= short / size
    return result


@lru_cache(maxsize=64)
def _response(band: Band, rows: int, logs: int, after: int) -> tuple[int, Array | None, int]:
    """Computes the transform length without wrap-around, the zero-phase response of the filter, and its reach.

    Args:
        band: the filter is that of this band.
        rows: decimated rows of all logs.
        logs: number of logs.
        after: length of the filter for decimated rows.

    Returns:
        Length; response, None without filter; zeros between logs, in decimated rows.
    """
    half = len(band.taps) // 2
    reach = -(-2 * half // band.stride) + after
    size = band.stride * scipy.fft.next_fast_len(rows + logs * reach)
    if not half:
        return size, None, reach
    centred = np.zeros(size)
    centred[: half + 1] = band.taps[half:]
    centred[-half:] = band.taps[:half]
    return size, scipy.fft.rfft(centred).real, reach


def find_bands(
    recording: Recording,
    inertia: Array,
    torque_density: Array,
    share: float = MAX_MOTION_ERROR,
    highest: float | Array = np.inf,
) -> tuple[Band, ...]:
    """Finds each joint's band, which ends where the acceleration error, as a torque, approaches the torque noise.

    All joints are decimated alike, as far as the widest band permits.

    Args:
        recording: the data.
        inertia: torque on each joint per acceleration of each (n, n) [kg m2].
        torque_density: power density of the torque noise at high frequencies (n,) [(N m)^2/Hz].
        share: largest power of the acceleration error, as a share of the torque noise.
        highest: upper bound of the cut-offs [Hz], a number or (n,).

    Returns:
        The band of each joint.
    """
    rate = 1 / recording.step
    error = np.maximum(inertia**2 @ recording.floor, 1e-300)
    limits = np.minimum((share * torque_density / error) ** 0.25 / (2 * np.pi), highest)
    cutoffs = np.clip(limits, min(SLOWEST, FASTEST * rate), FASTEST * rate)
    stride = max(1, int(rate / (2.5 * cutoffs.max()) + WHOLE))
    return tuple(low_pass(float(cutoff), rate, stride) for cutoff in cutoffs)


def unbiased_frequencies(recording: Recording, inertia: Array, residual: Array, moving: Array | float = 1.0) -> Array:
    """Finds the frequencies (n,) [Hz] up to which acceleration errors do not bias the model significantly.

    An error of energy E in a column of total energy G, both in units of the noise, reduces its coefficient by the share
    E / G. The residual of that bias has the energy (E / G)^2 (G - E).

    Args:
        recording: the data.
        inertia: torque on each joint per acceleration of each (n, n) [kg m2].
        residual: torque minus model (N, n) [N m or N].
        moving: share of the rows (n,) in which each joint moves; only these count.

    Returns:
        The frequencies; infinity where no bias is significant, or the logs are too short.
    """
    lengths = [run.stop - run.start for run in recording.runs]
    window = min(max(lengths), round(WINDOW / recording.step))
    if window < FEWEST:
        return np.full(recording.n, np.inf)
    long = [run for run, length in zip(recording.runs, lengths, strict=True) if length >= window]

    def density(series: Array) -> tuple[Array, Array]:
        spectra = [welch(series[run], 1 / recording.step, nperseg=window, axis=0) for run in long]
        weights = [run.stop - run.start for run in long]
        return spectra[0][0], np.average([power for _, power in spectra], axis=0, weights=weights)

    f, noise = density(residual)
    energies = 2 * recording.duration * f[1] * moving / np.maximum(noise, QUIETEST)
    column = np.cumsum(density(recording.ddq @ inertia.T)[1] * energies, axis=0)
    error = np.cumsum((2 * np.pi * f[:, None]) ** 4 * (moving * (inertia**2 @ recording.floor)) * energies, axis=0)
    shown = np.minimum(error / np.maximum(column, QUIETEST), 1.0) ** 2 * (column - error) > MAX_BIAS_CHI2
    return np.where(shown.any(axis=0), f[np.argmax(shown, axis=0)], np.inf)


def low_pass(cutoff: float, rate: float, stride: int) -> Band:
    """Builds a low-pass with a cut-off [Hz] for rows at a rate [Hz], of which one in `stride` is kept."""
    length = int(np.ceil(3.6 * rate / (TRANSITION * cutoff))) | 1
    return Band(firwin(length, cutoff * (1 - TRANSITION / 2), fs=rate, window=("kaiser", 6.0)), stride, cutoff)
