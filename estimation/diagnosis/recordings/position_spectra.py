"""Spectra of positions: the frequency at which motion meets the encoder noise, and the density of that noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import welch

from estimation.diagnosis.recordings.smoothed_motion import low_pass_gain
from estimation.preprocessing import Resampled, between_rows

Array = NDArray[np.float64]

# Power over the encoder noise from which a frequency counts as motion.
STANDS_OUT = 3.0
# Bounds of the cut-off: least [Hz], most [share of the sampling rate].
LOWEST, HIGHEST = 2.0, 0.4
# Cut-offs that are tried, as multiples of the frequency at which motion meets noise.
HIGHER = np.geomspace(1.0, 2.0, 11)
# Order of the difference of the positions whose spectrum is taken: slow motion would otherwise leak over the whole
# band.
DIFFERENCE = 3
# Number of white noise sequences by which the effect of interpolation is measured. `SLOW` bounds the frequencies, as
# shares of the sampling rate, that interpolation does not attenuate.
DRAWN, SLOW = 4, (0.02, 0.1)


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Spectrum of one position.

    Attributes:
        f: frequencies (F,) [Hz].
        density: power density (F,) [rad^2/Hz or m^2/Hz], scaled so that encoder noise is white.
        floor: power density of the encoder noise [rad^2/Hz or m^2/Hz].
        rate: sampling rate [Hz].
    """

    f: Array
    density: Array
    floor: float
    rate: float

    def at(self, frequency: float) -> float:
        """Interpolates the power density at a frequency [Hz]."""
        return float(np.interp(frequency, self.f, self.density))

    def noise_at(self, frequency: float) -> float:
        """Returns the noise density if everything above a frequency [Hz] is noise."""
        return max(self.at(frequency), self.floor)

    def cutoff(self, none: float = LOWEST) -> float:
        """Returns the frequency [Hz] at which motion meets the noise; `none` if no motion exceeds the noise."""
        if self.floor <= 0:
            return none if not self.density.any() else HIGHEST * self.rate
        lost = np.flatnonzero((self.density < STANDS_OUT * self.floor) & (self.f > 4 * self.f[1]))
        cutoff = float(self.f[lost[0]]) if len(lost) else HIGHEST * self.rate
        if none == 0.0 and cutoff <= 5 * self.f[1]:
            return 0.0
        cutoff = float(np.clip(cutoff, min(LOWEST, HIGHEST * self.rate), HIGHEST * self.rate))
        return min(self._spared(cutoff), HIGHEST * self.rate)

    def _spared(self, meets: float) -> float:
        """Raises the cut-off `meets` [Hz] if a low-pass there would remove more than noise.

        The spectrum of a motion of a few sines ends abruptly, and a low-pass at that edge distorts the last sine. The
        power that the acceleration loses must not exceed the noise power that it keeps.
        """
        motion = np.where(self.f < meets, np.maximum(self.density - self.floor, 0.0), 0.0)
        for cutoff in meets * HIGHER:
            kept = low_pass_gain(self.f, cutoff)
            weight = self.f**4
            if np.sum(weight * motion * (1 - kept) ** 2) <= np.sum(weight * self.floor * kept**2):
                return float(cutoff)
        return float(meets * HIGHER[-1])


@dataclass(frozen=True, eq=False)
class Spectra:
    """Settings for the spectra of a log's positions.

    Attributes:
        period: sample period [s].
        f: frequencies (F,) [Hz] at which the gain of interpolation is known; empty for evenly sampled logs.
        passed: power gain of interpolation (F,) for white encoder noise, relative to low frequencies.
    """

    period: float
    f: Array
    passed: Array

    @staticmethod
    def of(positions: Resampled) -> Spectra:
        """Measures how interpolation between rows attenuates white noise at high frequencies.

        Without this correction the noise would be underestimated at the upper end of the band, and noise would count as
        motion.
        """
        if positions.q is positions.fresh_q:
            return Spectra(positions.period, np.zeros(0), np.zeros(0))
        drawn = np.random.default_rng(0).normal(size=(len(positions.fresh_t), DRAWN))
        noise = between_rows(positions.fresh_t, drawn, np.minimum(positions.t, positions.fresh_t[-1]), positions.period)
        f, density = _density(noise[:, 0], positions.period)
        density = np.mean([density, *(_density(column, positions.period)[1] for column in noise.T[1:])], axis=0)
        # The lowest frequencies are inaccurate: their power is divided by nearly zero.
        slow = density[(f > SLOW[0] / positions.period) & (f < SLOW[1] / positions.period)]
        return Spectra(positions.period, f, density / float(np.median(slow)))

    def of_positions(self, x: Array) -> Spectrum:
        """Computes the spectrum of a position (N,) [rad or m]."""
        f, density = _density(x, self.period)
        if len(self.f):
            density = density / np.interp(f, self.f, self.passed)
        # The upper end of the band contains encoder noise only.
        floor = float(np.median(density[f > HIGHEST / self.period]))
        smooth = np.convolve(np.pad(density, 2, mode="edge"), np.ones(5) / 5, mode="valid")
        return Spectrum(f, smooth, floor, 1 / self.period)


def _density(x: Array, period: float) -> tuple[Array, Array]:
    length = min(len(x) - DIFFERENCE, max(64, round(8 / period)))
    f, power = welch(np.diff(x, DIFFERENCE), 1 / period, "blackmanharris", length, detrend=False)
    shape = (2 * np.sin(np.pi * f * period)) ** (2 * DIFFERENCE)
    density = np.divide(power, shape, out=np.zeros_like(power), where=shape > 0)
    density[0] = density[1]
    return f, density
