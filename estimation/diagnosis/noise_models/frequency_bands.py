"""The bands of frequencies in which motion is known: torque and columns are low-passed alike, and thinned."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Literal, overload

import numpy as np
import scipy.fft
from numpy.typing import NDArray
from scipy.signal import firwin, welch

from estimation.diagnosis.calibration import MAX_BIAS_CHI2, MAX_MOTION_ERROR
from estimation.diagnosis.recordings.log_reading import Recording

Array = NDArray[np.float64]
Small = NDArray[np.float32]

# Spectra are taken over so long [s], of so many rows at least; a power density, or a column, below this is none.
WINDOW, FEWEST, QUIETEST = 8.0, 16, 1e-100
# Slowest low-pass [Hz], fastest as a share of the sampling rate: above, a sampled kick is no longer what it was.
SLOWEST, FASTEST = 4.0, 0.2
TRANSITION = 0.25  # of the low-pass, as a share of its cut-off
# A stride this near below a whole number is one: steps are rounded.
WHOLE = 1e-6


@dataclass(frozen=True, eq=False)
class Band:
    """The frequencies in which a joint's torque is known: it and all its columns are low-passed alike, and thinned.

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
        """Filters and thins rows (N,) or (N, k) of logs that begin at `starts`, each by itself.

        A filter `after` (p,) acts on what is left. Columns that lie one after the other in memory (Fortran's order) are
        filtered several times as fast; with `single` precision twice as fast again, their rounding then 1e-7 of the
        largest.
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
        # Between logs there are as many zeros as the filters reach.
        size, response, reach = _response(self, sum(lengths), len(runs), 0 if after is None else len(after))
        places = np.cumsum([0, *lengths[:-1]]) + reach * np.arange(len(runs))
        # Two real columns are one complex one, the filters being real; as large as each other, so that the rounding of
        # neither shows in the other, and zeros stay zeros.
        sizes = np.maximum(columns.max(axis=1, initial=0.0), -columns.min(axis=1, initial=0.0))[:, None]
        units = 1.0 / np.where(sizes > QUIETEST, sizes, 1.0)
        half = len(columns) // 2
        packed = np.zeros((len(columns) - half, size), dtype=np.complex64 if single else np.complex128)
        for run, place in zip(runs, places * self.stride, strict=True):
            there = slice(place, place + run.stop - run.start)
            np.multiply(columns[::2, run], units[::2], out=packed.real[:, there], casting="same_kind")
            np.multiply(columns[1::2, run], units[1::2], out=packed.imag[:half, there], casting="same_kind")
        spectrum = scipy.fft.fft(packed, axis=1, overwrite_x=True)
        if response is not None:
            spectrum *= response.astype(spectrum.dtype, copy=False)
        # Thinned rows have the mean of the spectra that fall onto each other.
        folded = spectrum
        if self.stride > 1:
            folded = spectrum.reshape(len(packed), self.stride, -1).sum(axis=1) / self.stride
        if after is not None:
            folded *= scipy.fft.fft(after, folded.shape[1]).astype(folded.dtype, copy=False)
        thin = scipy.fft.ifft(folded, axis=1, overwrite_x=True)
        result: Array | Small = np.empty((len(columns), sum(lengths)), dtype=kind)
        first = 0
        for place, length in zip(places, lengths, strict=True):
            own, there = slice(first, first + length), slice(place, place + length)
            np.multiply(thin.real[:, there], sizes[::2], out=result[::2, own], casting="same_kind")
            np.multiply(thin.imag[:half, there], sizes[1::2], out=result[1::2, own], casting="same_kind")
            first += length
        return result[0] if series.ndim == 1 else result.T


@lru_cache(maxsize=64)
def _response(band: Band, rows: int, logs: int, after: int) -> tuple[int, NDArray[np.complex128] | None, int]:
    """The length of transforms in which nothing wraps round, the filter's response with no delay, and its reach.

    Args:
        band: its filter is the first.
        rows: thinned ones of all logs.
        logs: how many.
        after: length of the filter of thinned rows.

    Returns:
        Length, response, and how many thinned rows apart logs must be.
    """
    half = len(band.taps) // 2
    reach = -(-2 * half // band.stride) + after
    size = band.stride * scipy.fft.next_fast_len(rows + logs * reach)
    if not half:
        return size, None, reach
    centred = np.zeros(size)
    centred[: half + 1] = band.taps[half:]
    centred[-half:] = band.taps[:half]
    return size, scipy.fft.fft(centred), reach


def find_bands(
    recording: Recording,
    inertia: Array,
    torque_density: Array,
    share: float = MAX_MOTION_ERROR,
    highest: float | Array = np.inf,
) -> tuple[Band, ...]:
    """Finds each joint's band: up to where the error of all accelerations, as a torque, comes near the torque noise.

    Rows are thinned alike for all joints, by what the fastest band needs.

    Args:
        recording: the data.
        inertia: torque on each joint per acceleration of each (n, n) [kg m2].
        torque_density: power density of the torque noise at high frequency (n,) [(N m)^2/Hz].
        share: of the torque noise's power, what the error may have.
        highest: that the bands may end at [Hz], a number or (n,).
    """
    rate = 1 / recording.step
    error = np.maximum(inertia**2 @ recording.floor, 1e-300)
    limits = np.minimum((share * torque_density / error) ** 0.25 / (2 * np.pi), highest)
    cutoffs = np.clip(limits, min(SLOWEST, FASTEST * rate), FASTEST * rate)
    stride = max(1, int(rate / (2.5 * cutoffs.max()) + WHOLE))
    return tuple(low_pass(float(cutoff), rate, stride) for cutoff in cutoffs)


def unbiased_frequencies(recording: Recording, inertia: Array, residual: Array, moving: Array | float = 1.0) -> Array:
    """Finds up to which frequencies (n,) [Hz] the errors of accelerations bias no model by what shows.

    An error of energy E in a column that has the energy G with it, both over the noise's, takes the share E / G off its
    coefficient; what that leaves has this share squared of G - E.

    Args:
        recording: the data.
        inertia: torque on each joint per acceleration of each (n, n) [kg m2].
        residual: torque less model (N, n) [N m or N].
        moving: share of the rows (n,) in which each joint moves: the others count for nothing.
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
    """Builds a low-pass [Hz] for rows at a rate [Hz], of which `stride` become one."""
    length = int(np.ceil(3.6 * rate / (TRANSITION * cutoff))) | 1
    return Band(firwin(length, cutoff * (1 - TRANSITION / 2), fs=rate, window=("kaiser", 6.0)), stride, cutoff)
