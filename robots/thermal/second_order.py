"""The second-order thermal model of a joint: two heat capacities, one of which the friction heats (thesis eq. 116)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robots.common.errors import InputError

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class SecondOrder:
    """Zone 1 is heated by friction and gives heat to zone 2, which gives it to the surroundings.

        C1 dT1/dt = W (alpha (T1 - Te) + beta) - K1 (T1 - T2)
        C2 dT2/dt = K1 (T1 - T2) - K2 (T2 - Te)

    W is the power that friction would have at the surroundings' temperature Te, so that all is linear in T1 and T2
    while W is constant (thesis eq. 105, 116 and 117).

    Args:
        alpha: relative change of friction per degree [1/K], zero or less.
        beta: friction at the surroundings' temperature over its reference, 1 but for errors of the fit.
        K1: heat exchange between the zones [W/K].
        K2: heat exchange with the surroundings [W/K].
        C1: heat capacity where heat is produced [J/K].
        C2: heat capacity around it [J/K].
        ambient: temperature of the surroundings Te [degC].

    Raises:
        InputError: a parameter that is out of range or not finite.
    """

    alpha: float
    beta: float
    K1: float
    K2: float
    C1: float
    C2: float
    ambient: float = 20.0

    def __post_init__(self) -> None:
        for name in ("beta", "K1", "K2", "C1", "C2"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0.0):
                raise InputError(f"thermal model: {name} is {value}", allowed="a positive number")
        if not (np.isfinite(self.alpha) and self.alpha <= 0.0):
            raise InputError(f"thermal model: alpha is {self.alpha}", allowed="zero or a negative number")
        if not np.isfinite(self.ambient):
            raise InputError(f"thermal model: the ambient temperature is {self.ambient}", allowed="a finite number")

    def friction_factor(self, temperature: ArrayLike) -> Array:
        """Friction over that at the surroundings' temperature: alpha (T1 - Te) + beta (thesis eq. 104).

        Args:
            temperature: T1 [degC], of any shape.

        Returns:
            The factor, of the same shape.
        """
        return self.alpha * (np.asarray(temperature, dtype=np.float64) - self.ambient) + self.beta

    def system(self, power: ArrayLike) -> tuple[Array, Array]:
        """Gives A and b of d(T - Te)/dt = A (T - Te) + b (thesis eq. 120 and 121, with temperatures above Te).

        Args:
            power: W [W], of any shape, zero or more.

        Returns:
            A (..., 2, 2) [1/s] and b (..., 2) [K/s].

        Raises:
            InputError: a power that is negative or not finite.
        """
        W = _powers(power)
        A, b = np.empty((*W.shape, 2, 2)), np.zeros((*W.shape, 2))
        A[..., 0, 0] = (W * self.alpha - self.K1) / self.C1
        A[..., 0, 1] = self.K1 / self.C1
        A[..., 1, 0] = self.K1 / self.C2
        A[..., 1, 1] = -(self.K1 + self.K2) / self.C2
        b[..., 0] = W * self.beta / self.C1
        return A, b

    def time_constants(self, power: ArrayLike) -> Array:
        """Gives the slow and the fast time constant at constant power (thesis eq. 125 to 127).

        Args:
            power: W [W], of any shape.

        Returns:
            (..., 2) [s], the slow one first.
        """
        mean, spread = self._rates(self.system(power)[0])
        return np.stack([-1.0 / (mean + spread), -1.0 / (mean - spread)], axis=-1)

    def steady_state(self, power: ArrayLike) -> Array:
        """Gives the temperatures that are reached at constant power (thesis eq. 124).

        Args:
            power: W [W], of any shape.

        Returns:
            T1 and T2, (..., 2) [degC].
        """
        W = _powers(power)
        # All heat crosses both exchanges in turn.
        flow = W * self.beta / (1.0 - W * self.alpha * (1.0 / self.K1 + 1.0 / self.K2))
        return self.ambient + np.stack([flow * (1.0 / self.K1 + 1.0 / self.K2), flow / self.K2], axis=-1)

    def transition(self, power: ArrayLike, step: ArrayLike) -> tuple[Array, Array]:
        """Discretises exactly: T(t + step) = T_inf + Phi (T(t) - T_inf) at constant power (thesis eq. 122).

        Args:
            power: W [W], of any shape.
            step: time [s], of that shape or one for all, zero or more.

        Returns:
            Phi = exp(A step) (..., 2, 2) and T_inf (..., 2) [degC].

        Raises:
            InputError: a negative power or time.
        """
        A, _ = self.system(power)
        h = np.broadcast_to(np.asarray(step, dtype=np.float64), A.shape[:-2])
        if not np.all(np.isfinite(h) & (h >= 0.0)):
            raise InputError("thermal model: a time step is negative or not finite", allowed="zero or more seconds")
        mean, spread = self._rates(A)
        # The eigenvalues mean +- spread are real and differ, because the exchange between the zones goes both ways.
        slow, fast = np.exp((mean + spread) * h), np.exp((mean - spread) * h)
        even, odd = (slow + fast) / 2.0, (slow - fast) / (2.0 * spread)
        identity = np.eye(2)
        Phi = even[..., None, None] * identity + odd[..., None, None] * (A - mean[..., None, None] * identity)
        return Phi, self.steady_state(power)

    def temperatures(self, power: ArrayLike, steps: ArrayLike, *, start: ArrayLike | None = None) -> Array:
        """Follows the temperatures while the power is constant in each of N steps; exact, however long the steps.

        Args:
            power: W in each step, (N,) [W].
            steps: how long each lasts [s], (N,) or one number.
            start: T1 and T2 at first, (2,) [degC]; those of the surroundings by default.

        Returns:
            T1 and T2 before the first step and after each, (N + 1, 2) [degC].

        Raises:
            InputError: arrays of other shapes, or a negative power or time.
        """
        W = _powers(power)
        if W.ndim != 1:
            raise InputError(f"thermal model: powers of shape {W.shape}", allowed="shape (N,)")
        first = np.full(2, self.ambient) if start is None else np.asarray(start, dtype=np.float64)
        if first.shape != (2,) or not np.isfinite(first).all():
            raise InputError(f"thermal model: start temperatures {first}", allowed="two finite numbers, T1 and T2")
        Phi, limit = self.transition(W, steps)
        result = np.empty((W.size + 1, 2))
        result[0] = first
        for k in range(W.size):
            result[k + 1] = limit[k] + Phi[k] @ (result[k] - limit[k])
        return result

    @staticmethod
    def _rates(A: Array) -> tuple[Array, Array]:
        """Mean of the two eigenvalues and half their difference [1/s]."""
        mean = (A[..., 0, 0] + A[..., 1, 1]) / 2.0
        half = (A[..., 0, 0] - A[..., 1, 1]) / 2.0
        return mean, np.sqrt(half**2 + A[..., 0, 1] * A[..., 1, 0])


def _powers(power: ArrayLike) -> Array:
    W = np.asarray(power, dtype=np.float64)
    if not np.all(np.isfinite(W) & (W >= 0.0)):
        raise InputError("thermal model: a friction power is negative or not finite", allowed="zero or more watts")
    return W
