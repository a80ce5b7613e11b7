"""The bands of frequencies in which motion is known: torque and columns are low-passed alike, and thinned."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, overload

import numpy as np
import scipy.fft
from numpy.typing import NDArray
from scipy.signal import firwin, welch

from estimation.diagnosis.recordings.log_reading import Recording

Array = NDArray[np.float64]
Small = NDArray[np.float32]

# The error of the acceleration may make this share of the torque noise's power; above, both are filtered away.
SHARE = 0.2
# Errors of accelerations make the inertia that is fitted too small: of its torque some stays, low-passed, and effects
# are taken for it. On its own the column of an inertia leaves no more of that than this, in units of a squared standard
# deviation; beside the other columns of a base model it is some ten times as much.
BIAS = 0.1
# Spectra are taken over so long [s], of so many rows at least; a power density, or a column, below this is none.
WINDOW, FEWEST, QUIETEST = 8.0, 16, 1e-100
# Slowest low-pass [Hz], fastest as a share of the sampling rate: above, a sampled kick is no longer what it was.
SLOWEST, FASTEST = 4.0, 0.2
TRANSITION = 0.25  # of the low-pass, as a share of its cut-off


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
    def passed(self, series: Array, after: Array | None = None, *, single: Literal[False] = False) -> Array: ...
    @overload
    def passed(self, series: Array, after: Array | None = None, *, single: Literal[True]) -> Small: ...
    def passed(self, series: Array, after: Array | None = None, *, single: bool = False) -> Array | Small:
        """Filters and thins rows (N,) or (N, k) of one log; `after` (p,) filters what is left.

        Columns that lie one after the other in memory (Fortran's order) are filtered several times as fast; with
        `single` precision twice as fast again, their rounding then 1e-7 of the largest.
        """
        kind: type = np.float32 if single else np.float64
        if not len(self.taps) and after is None:
            return series[:: self.stride].astype(kind, copy=False)
        rows = -(-len(series) // self.stride)
        if not series.size:  # a joint that does not move has no columns
            return np.zeros((rows, *series.shape[1:]), dtype=kind)
        columns = np.ascontiguousarray(series.T if series.ndim > 1 else series[None])
        # Two real columns are one complex one, the filters being real; as large as each other, so that the rounding of
        # neither shows in the other, and zeros stay zeros.
        sizes = np.maximum(columns.max(axis=1, initial=0.0), -columns.min(axis=1, initial=0.0))[:, None]
        units = 1.0 / np.where(sizes > QUIETEST, sizes, 1.0)
        packed = np.zeros((-(-len(columns) // 2), len(series)), dtype=np.complex64 if single else np.complex128)
        np.multiply(columns[::2], units[::2], out=packed.real)
        np.multiply(columns[1::2], units[1::2], out=packed.imag[: len(columns) // 2])
        size, response = _response(self, len(series), 0 if after is None else len(after))
        spectrum = scipy.fft.fft(packed, size, axis=1)
        if response is not None:
            spectrum *= response.astype(spectrum.dtype, copy=False)
        # Thinned rows have the mean of the spectra that fall onto each other.
        folded = spectrum.reshape(len(packed), self.stride, -1).sum(axis=1) / self.stride
        if after is not None:
            folded *= scipy.fft.fft(after, folded.shape[1]).astype(folded.dtype, copy=False)
        thin = scipy.fft.ifft(folded, axis=1, overwrite_x=True)[:, :rows]
        result: Array | Small = np.empty((len(columns), rows), dtype=kind)
        np.multiply(thin.real, sizes[::2], out=result[::2])
        np.multiply(thin.imag[: len(columns) // 2], sizes[1::2], out=result[1::2])
        return result[0] if series.ndim == 1 else result.T


@lru_cache(maxsize=64)
def _response(band: Band, rows: int, after: int) -> tuple[int, NDArray[np.complex128] | None]:
    """The length of transforms in which nothing wraps round, and the filter's response with no delay."""
    half = len(band.taps) // 2
    size = band.stride * scipy.fft.next_fast_len(-(-(rows + 2 * half) // band.stride) + after)
    if not half:
        return size, None
    centred = np.zeros(size)
    centred[: half + 1] = band.taps[half:]
    centred[-half:] = band.taps[:half]
    return size, scipy.fft.fft(centred)


def find_bands(
    recording: Recording, inertia: Array, torque_density: Array, share: float = SHARE, highest: float | Array = np.inf
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
    stride = max(1, int(rate / (2.5 * cutoffs.max())))
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
    shown = np.minimum(error / np.maximum(column, QUIETEST), 1.0) ** 2 * (column - error) > BIAS
    return np.where(shown.any(axis=0), f[np.argmax(shown, axis=0)], np.inf)


def low_pass(cutoff: float, rate: float, stride: int) -> Band:
    """Builds a low-pass [Hz] for rows at a rate [Hz], of which `stride` become one."""
    length = int(np.ceil(3.6 * rate / (TRANSITION * cutoff))) | 1
    return Band(firwin(length, cutoff * (1 - TRANSITION / 2), fs=rate, window=("kaiser", 6.0)), stride, cutoff)
