"""Spectra of positions: up to which frequency they are motion, and how loud their encoder is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import welch

from estimation.diagnosis.recordings.smoothed_motion import low_pass_gain
from estimation.preprocessing import Resampled, between_rows

Array = NDArray[np.float64]

# A frequency of a position is kept where its power is this much above the encoder's noise.
STANDS_OUT = 3.0
# Least and most of the cut-off [Hz, share of the sampling rate].
LOWEST, HIGHEST = 2.0, 0.4
# Cut-offs that are tried, over the frequency at which motion meets noise.
HIGHER = np.geomspace(1.0, 2.0, 11)
# Spectra are taken of this difference of the positions: the slow motion would leak over all of the band otherwise.
DIFFERENCE = 3
# Encoders that are drawn to see what interpolation makes of their noise, and shares of the rate between which all of it
# stays.
DRAWN, SLOW = 4, (0.02, 0.1)


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Of one position.

    Attributes:
        f: frequencies [Hz].
        density: power density, as it would be if the encoder's noise were white.
        floor: density of that noise.
        rate: of the samples [Hz].
    """

    f: Array
    density: Array
    floor: float
    rate: float

    def at(self, frequency: float) -> float:
        """Gives the density at a frequency [Hz]."""
        return float(np.interp(frequency, self.f, self.density))

    def noise_at(self, frequency: float) -> float:
        """Gives the density at a frequency [Hz] above which all is noise."""
        return max(self.at(frequency), self.floor)

    def cutoff(self, none: float = LOWEST) -> float:
        """Gives the frequency at which the position meets its noise [Hz]; `none` where nothing stands out."""
        if self.floor <= 0:
            return none if not self.density.any() else HIGHEST * self.rate
        lost = np.flatnonzero((self.density < STANDS_OUT * self.floor) & (self.f > 4 * self.f[1]))
        cutoff = float(self.f[lost[0]]) if len(lost) else HIGHEST * self.rate
        if none == 0.0 and cutoff <= 5 * self.f[1]:
            return 0.0
        cutoff = float(np.clip(cutoff, min(LOWEST, HIGHEST * self.rate), HIGHEST * self.rate))
        return min(self._spared(cutoff), HIGHEST * self.rate)

    def _spared(self, meets: float) -> float:
        """Raises the frequency at which a position meets its noise, where a low-pass there would cut more than noise.

        A motion of a few sines ends at its last as at an edge, which a low-pass that ends there bends. What the
        acceleration loses of the motion below it must be no more power than the noise that it keeps.
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
    """How the spectra of a log's positions are taken.

    Attributes:
        period: of the samples [s].
        f: frequencies [Hz] at which it is known what becomes of white noise; none for even samples.
        passed: density there of what was white noise of an encoder, over its density far below.
    """

    period: float
    f: Array
    passed: Array

    @staticmethod
    def of(positions: Resampled) -> Spectra:
        """Finds what interpolation makes of white noise: between rows it has less of the fast one.

        Taken for white, its end of the band would tell a noise that is too small, and noise would count as motion.
        """
        if positions.q is positions.fresh_q:
            return Spectra(positions.period, np.zeros(0), np.zeros(0))
        drawn = np.random.default_rng(0).normal(size=(len(positions.fresh_t), DRAWN))
        noise = between_rows(positions.fresh_t, drawn, np.minimum(positions.t, positions.fresh_t[-1]), positions.period)
        f, density = _density(noise[:, 0], positions.period)
        density = np.mean([density, *(_density(column, positions.period)[1] for column in noise.T[1:])], axis=0)
        # The slowest are not determined: their power is divided by nearly zero.
        slow = density[(f > SLOW[0] / positions.period) & (f < SLOW[1] / positions.period)]
        return Spectra(positions.period, f, density / float(np.median(slow)))

    def of_positions(self, x: Array) -> Spectrum:
        """Takes the spectrum of a position (N,)."""
        f, density = _density(x, self.period)
        if len(self.f):
            density = density / np.interp(f, self.f, self.passed)
        # The encoder's noise is what the end of the band holds.
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
