"""Sensors of a virtual robot: encoder steps and correlated torque noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from robots.common.arrays import Array
from robots.common.errors import InputError


@dataclass(frozen=True, kw_only=True)
class Sensors:
    """The sensors of a robot's drives.

    Attributes:
        encoder_counts: steps per motor turn; 0 for an ideal encoder. A prismatic joint counts per 2 pi of motor angle
            as well, its gear ratio being motor angle [rad] over travel [m].
        torque_noise: standard deviation of the torque noise, as a share of each joint's torque RMS.
        coloured_share: the part of the noise's variance that is coloured (first-order autoregressive); the rest is
            white.
        correlation_time: time constant of the coloured part [s].
        torque_step: resolution of the logged torque [N m]; 0 for none.

    Raises:
        InputError: a negative number, or a share outside 0 to 1.
    """

    encoder_counts: float = 131072.0
    torque_noise: float = 0.02
    coloured_share: float = 0.5
    correlation_time: float = 0.04
    torque_step: float = 0.0

    def __post_init__(self) -> None:
        """Checks the ranges."""
        for name in ("encoder_counts", "torque_noise", "correlation_time", "torque_step"):
            if not 0 <= getattr(self, name) < np.inf:
                raise InputError(f"sensors: {name} is {getattr(self, name)}", allowed="zero or a positive number")
        if not 0 <= self.coloured_share <= 1:
            raise InputError(f"sensors: coloured_share is {self.coloured_share}", allowed="0 to 1")

    def position(self, q: Array, gear_ratio: Array) -> Array:
        """Rounds joint positions (N, n) to the encoders' steps.

        Args:
            q: positions (N, n) [rad or m].
            gear_ratio: motor turns per joint turn (n,).
        """
        if not self.encoder_counts:
            return q
        step = 2 * np.pi / (self.encoder_counts * np.abs(gear_ratio))
        return np.round(q / step) * step

    def torque(self, tau: Array, period: float, rng: np.random.Generator) -> Array:
        """Adds noise to joint torques (N, n), and rounds them.

        Args:
            tau: torques (N, n) [N m or N].
            period: sample period [s].
            rng: source of the noise.
        """
        level = self.torque_noise * np.sqrt(np.mean(tau**2, axis=0))
        white = rng.standard_normal(tau.shape)
        coloured = _autoregressive(rng.standard_normal(tau.shape), period, self.correlation_time)
        share = self.coloured_share
        noisy = tau + level * (np.sqrt(1 - share) * white + np.sqrt(share) * coloured)
        return np.round(noisy / self.torque_step) * self.torque_step if self.torque_step else noisy


def _autoregressive(innovations: Array, period: float, correlation_time: float) -> Array:
    """Makes stationary noise of variance 1 whose autocorrelation falls by e within the correlation time."""
    rho = np.exp(-period / correlation_time) if correlation_time else 0.0
    driven = innovations * np.sqrt(1 - rho**2)
    driven[0] = innovations[0]
    return np.asarray(lfilter([1.0], [1.0, -rho], driven, axis=0))
