"""Dynamics of single samples: arrays that are laid out once, without checks at each call."""

from __future__ import annotations

import numpy as np

from estimation.external_forces.residuals.dynamics import Dynamics, covariance_root
from estimation.external_forces.thresholds.error_models import ErrorModel
from robots.common.arrays import Array


class StepFunction:
    """Evaluates momentum, torques, Jacobian and variance of one sample at a time.

    Args:
        dynamics: of the model.
    """

    def __init__(self, dynamics: Dynamics) -> None:
        n, size = dynamics.n, len(dynamics.values)
        self._q, self._dq, self._ddq = np.zeros((3, 1, n))
        pi = np.array(dynamics.values)[None]
        self._momentum, self._rest, self._friction = np.zeros((3, 1, n, 1))
        self._jacobian = np.zeros((1, 6, n))
        outputs = (self._momentum, self._rest, self._friction, self._jacobian)
        self._run = dynamics.evaluator.bound((self._q, self._dq, pi), outputs)
        self._root = covariance_root(dynamics.covariance)
        self._Y = np.zeros((1, n, size))
        regressor = dynamics.torque_model.evaluator(dynamics.columns)
        self._regress = regressor.bound((self._q, self._dq, self._ddq), (self._Y,))

    def __call__(self, q: Array, dq: Array) -> tuple[Array, Array, Array, Array]:
        """Gives p, beta without friction, friction (n,), and the tool point's Jacobian (6, n)."""
        self._q[0], self._dq[0] = q, dq
        self._run()
        return (
            self._momentum[0, :, 0].copy(),
            self._rest[0, :, 0].copy(),
            self._friction[0, :, 0].copy(),
            self._jacobian[0].copy(),
        )

    def variance(self, q: Array, dq: Array, ddq: Array) -> Array:
        """Gives the variance (n,) of the torque by the parameters' errors [(N m)^2]."""
        self._q[0], self._dq[0], self._ddq[0] = q, dq, ddq
        self._regress()
        spread = self._Y[0] @ self._root
        return np.asarray(np.einsum("jr,jr->j", spread, spread))


class StepErrors:
    """`ErrorModel` for one sample at a time: the same formulas, on arrays that are laid out once.

    Args:
        errors: of a healthy robot.
    """

    def __init__(self, errors: ErrorModel) -> None:
        n = len(errors.level)
        self._errors, self._level, self._weights, self._holding = errors, errors.level, errors.weights, errors.holding
        self._narrow, self._hold = -0.5 / errors.width**2, errors.coulomb / np.sqrt(3.0)
        self._inverse = np.linalg.inv(errors.correlation)
        self._now = np.zeros((4, n))
        self.widens = bool((errors.leverage + errors.inside + errors.beyond).any())
        """Whether the parameters' errors count at all."""

    def amplitudes(self, dq: Array, friction: Array, variance: Array | None) -> Array:
        """Gives w_1 to w_4 before the filter (4, n), valid until the next call."""
        now = self._now
        np.exp(self._narrow * dq * dq, out=now[0])
        np.abs(friction, out=now[1])
        if variance is not None:
            now[2] = self._errors.parameter_amplitude(variance)
        np.divide(self._hold, 1.0 + (dq / self._holding) ** 2, out=now[3])
        return now

    def deviation(self, amplitudes: Array) -> Array:
        """Gives the residual's standard deviation (n,) of filtered amplitudes (4, n)."""
        return np.asarray(np.sqrt(self._level + np.einsum("kj,kj,kj->j", self._weights, amplitudes, amplitudes)))

    def statistic(self, residual: Array, deviation: Array) -> float:
        """Gives the squared distance of a residual (n,) from zero."""
        z = residual / deviation
        return float(z @ self._inverse @ z)
