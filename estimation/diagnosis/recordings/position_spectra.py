"""Cut-offs of positions: where their spectra meet the encoder noise, and how well the base model then fits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import welch

from estimation.diagnosis.recordings.smoothed_motion import low_pass_gain, smooth_motion
from estimation.linear_algebra.orthonormal import orthonormal
from estimation.preprocessing import Resampled, between_rows
from estimation.regressions.preparation import Prepared
from robots.common.arrays import Array
from robots.regressor import default_model
from robots.robot import Robot
from robots.terms.situations.flange_body import with_body

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


CAPS = (40.0, 25.0, 16.0, 10.0, 6.5, 4.0)  # [Hz]
# Cut-offs [Hz] that are tried first, to see whether a lower one helps at all.
TELLING = (10.0, 4.0)
# A lower cut-off is needed if it reduces the residual below this share. An elastic gear or a delayed torque changes the
# base model's residual far less.
SPOILT = 0.7
# Residuals within this factor of the best are equivalent.
NEAR = 1.1
ROWS = 1000
WIDTH = 0.02  # [rad/s or m/s] width of the friction sign
STALLED = 0.05  # share of a joint's RMS speed below which the sign of its friction is unknown
FAINT = 1e-3


def select_position_cutoff(robot: Robot, logs: Sequence[Prepared], cutoffs: Array) -> float:
    """Selects the highest frequency [Hz] at which positions are motion, by the residual of the base model.

    Encoder noise is white while the joint crosses encoder steps quickly. If a joint is slow, or samples repeat, the
    noise has more power at low frequencies, as motion has. A spectrum then shows no noise floor. Such noise dominates
    the acceleration and distorts all columns that share parameters with it, gravity first. As long as a lower cut-off
    removes noise, the base model fits better.

    Args:
        robot: the robot.
        logs: logs with torque, and positions on a grid.
        cutoffs: cut-offs of the joints by their spectra (n,) [Hz].

    Returns:
        The highest of `CAPS` [Hz] with a residual near the smallest; infinity if no lower cut-off is needed.
    """
    known = {np.inf: _residual(robot, logs, cutoffs)}

    def best(caps: Sequence[float]) -> float:
        for cap in caps:
            if cap < float(np.max(cutoffs)) and cap not in known:
                known[cap] = _residual(robot, logs, np.minimum(cutoffs, cap))
        return min(known.values())

    if best(TELLING) >= known[np.inf] + np.log(SPOILT):
        return np.inf
    least = best(CAPS)
    return max(cap for cap, error in known.items() if error <= least + np.log(NEAR))


def _residual(robot: Robot, logs: Sequence[Prepared], cutoffs: Array) -> float:
    """Computes the mean over the joints of the logarithm of the base model's residual."""
    model = default_model(robot, velocity_scale=WIDTH)
    blocks, targets = [], []
    total = sum(len(log.positions.t) for log in logs)
    for log in logs:
        t, period = log.positions.t, log.positions.period
        q, dq, ddq = smooth_motion(log.positions.q, period, cutoffs)
        edge = min(round(1 / (float(cutoffs.min()) * period)), len(t) // 4)
        rows = np.arange(edge, len(t) - edge, max(1, total // ROWS))
        speed = np.sqrt(np.mean(dq**2, axis=0))
        known = (np.abs(dq[rows]) > STALLED * speed) | (speed < 1e-9)
        tau = np.column_stack([np.interp(t[rows], log.log.t, column) for column in log.tau.T])
        # Each log under its own conditions: a known payload or another gravity is not noise.
        motion = (q[rows], dq[rows], ddq[rows])
        own = model.under(log.log.gravity)
        if log.log.payload is not None:
            tau -= own.torque(*motion, with_body(model, np.zeros(model.size), log.log.payload))
        blocks.append(own.regressor(*motion) * known[:, :, None])
        targets.append(tau * known)
    Y, tau = np.concatenate(blocks), np.concatenate(targets)
    scale = np.maximum(tau.std(axis=0), 1e-9 * max(float(np.abs(tau).max()), 1e-12))
    flat = (Y / scale[:, None]).reshape(-1, Y.shape[2])
    target, basis = (tau / scale).reshape(-1), orthonormal(flat, FAINT)
    left = (target - basis @ (basis.T @ target)).reshape(tau.shape)
    return float(np.mean(np.log(np.maximum(np.sqrt(np.mean(left**2, axis=0)), 1e-9))))
