"""The fractional thermal model of a joint: a "first" order of 0 < nu < 1 (thesis eq. 132 to 142)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar, NamedTuple

import casadi
import numpy as np
from numpy.typing import ArrayLike

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.thermal.base import ThermalModel
from robots.thermal.checks import checked_power, checked_steps
from robots.thermal.mittag_leffler import mittag_leffler
from robots.thermal.parameters import ALPHA, BETA, Inputs, ThermalParameter, capacity, exchange


class _Grid(NamedTuple):
    """Rates of the memory in equal steps of their logarithm: relative error 2 e^(-pi^2 / step)."""

    slowest: float
    fastest: float
    step: float

    @property
    def size(self) -> int:
        """Rates between the slowest and the fastest."""
        return int(np.ceil(np.log(self.fastest / self.slowest) / self.step)) + 1


# Good to 1e-6 from 1 s to 10^6 s, and to 2e-4 from 10 s to 10^5 s: enough for a fit to noisy data.
_FINE, _COARSE = _Grid(1e-8, 1e2, 0.68), _Grid(1e-6, 1.0, 1.05)


@dataclass(frozen=True, kw_only=True)
class Fractional(ThermalModel):
    """One temperature with a memory that fades as a power of time, as heat does that diffuses into a solid.

        C d^nu T/dt^nu = W (alpha (T - T0) + beta) - K (T - Te)        (Caputo's derivative)

    At constant power the temperature follows a Mittag-Leffler function, in closed form. Where the power varies, the
    memory t^(nu - 1) / Gamma(nu) = sin(nu pi) / pi * integral lambda^-nu exp(-lambda t) d lambda is a sum of
    exponentials with fixed rates: the trapezoidal rule in log lambda, which is good to 1e-6 from 1 s to 10^6 s. The
    states are the temperature at the start and one integral a rate.

    A joint that starts warm is taken to have been that warm for ever: a fractional model's state is its whole past.

    Args:
        K: heat exchange with the environment [W/K].
        C: J s^(nu - 1) / K; a heat capacity only where nu is 1.
        nu: the order, above 0 and below 1.
    """

    name: ClassVar[str] = "fractional"
    parameters: ClassVar[tuple[ThermalParameter, ...]] = (
        ALPHA,
        BETA,
        exchange("K", "heat exchange with the environment", 2.5),
        capacity("C", "fractional heat capacity", 150.0, "J s^(nu-1)/K"),
        ThermalParameter(
            name="nu", unit="1", lower=0.1, upper=0.995, typical=0.7, positive=True, meaning="order of the derivative"
        ),
    )
    zones: ClassVar[tuple[str, ...]] = ("T",)

    K: float
    C: float
    nu: float

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.nu < 1.0:
            raise InputError(f"thermal model: nu is {self.nu}", allowed="above 0 and below 1")

    @classmethod
    def rates(cls, p: Mapping[str, Any], x: Sequence[Any], u: Inputs) -> list[Any]:
        """dz_i/dt = g - lambda_i z_i, with g the right-hand side of thesis eq. 139; the start does not move."""
        T = cls.zone_temperatures(p, x)[0]
        g = (u.power * (p["alpha"] * (T - p["T0"]) + p["beta"]) - p["K"] * (T - u.ambient)) / p["C"]
        return [0.0 * g, *(g - rate * z for rate, z in zip(memory_rates(len(x) - 1).tolist(), x[1:], strict=True))]

    @classmethod
    def state_count(cls, *, coarse: bool = False) -> int:
        """The temperature at the start, one integral a rate, and two for all slower and all faster rates."""
        return 3 + (_COARSE if coarse else _FINE).size

    @classmethod
    def zone_temperatures(cls, p: Mapping[str, Any], x: Sequence[Any]) -> list[Any]:
        """T = T_start + sum_i w_i z_i."""
        T = x[0]
        for weight, z in zip(memory_weights(p["nu"], len(x) - 1), x[1:], strict=True):
            T = T + weight * z
        return [T]

    @classmethod
    def start_state(cls, temperatures: Sequence[Any], size: int) -> list[Any]:
        """A past at this temperature, and nothing in the memory."""
        return [temperatures[0], *([0.0 * temperatures[0]] * (size - 1))]

    def rise(self, time: float) -> float:
        """Bounds the warming by 1 W within a time [s] from equilibrium [K]."""
        return float(time**self.nu / (self.C * math.gamma(1.0 + self.nu)))

    def time_constants(self, power: ArrayLike) -> Array:
        """Gives (C / (K - W alpha))^(1/nu), the time in which E_nu(-1) of the way is left, (..., 1) [s]."""
        W = checked_power(power)
        return np.asarray((self.C / (self.K - W * self.alpha)) ** (1.0 / self.nu))[..., None]

    def steady_state(self, power: ArrayLike, *, ambient: ArrayLike | None = None, drives: ArrayLike = 1.0) -> Array:
        """Gives the temperature that is reached at constant power (the limit of thesis eq. 141), (..., 1) [degC]."""
        W, around = checked_power(power), self._ambient(ambient)
        balance = self.K * around + W * (self.beta - self.alpha * self.T0)
        return np.asarray(balance / (self.K - W * self.alpha))[..., None]

    def response(self, t: ArrayLike, power: float, *, start: ArrayLike | None = None) -> Array:
        """Gives the temperature at constant power by the Mittag-Leffler function (thesis eq. 141), (N, 1) [degC]."""
        first = np.full(1, self.ambient) if start is None else np.asarray(start, dtype=np.float64)
        limit = self.steady_state(power)
        decay = mittag_leffler((self.K - power * self.alpha) / self.C * checked_steps(t) ** self.nu, self.nu)
        return limit + decay[:, None] * (first - limit)

    @classmethod
    def exponentials(cls, A: Array, h: Array) -> tuple[Array, Array]:
        """Gives exp(A h) and its integral over h: -Lambda + a 1 w' is symmetric once scaled by the roots of w."""
        rates = memory_rates(A.shape[-1] - 1)
        moving = A[:, 1:, 1:]
        # A zero of the weights does not occur; their scale cancels in the similarity.
        slope = moving[:, 0, :] + np.concatenate([[rates[0]], np.zeros(len(rates) - 1)])  # a w'
        root = np.sqrt(np.maximum(-slope, 1e-300))
        symmetric = -np.eye(len(rates)) * rates - root[:, :, None] * root[:, None, :]
        values, vectors = np.linalg.eigh(symmetric)
        values = np.minimum(values, -1e-300)
        exponent = values * h[:, None]
        back, forth = vectors / root[:, :, None], vectors * root[:, :, None]
        size = A.shape[-1]
        Phi, Gamma = np.zeros((2, len(A), size, size))
        for matrix, spectrum in ((Phi, np.exp(exponent)), (Gamma, np.expm1(exponent) / values)):
            matrix[:, 1:, 1:] = (back * spectrum[:, None, :]) @ forth.transpose(0, 2, 1)
        Phi[:, 0, 0], Gamma[:, 0, 0] = 1.0, h
        # The start acts on all integrals alike and does not move: one column of Gamma, and its integral.
        push = A[:, 1:, :1]
        Phi[:, 1:, :1] = Gamma[:, 1:, 1:] @ push
        twice = (np.expm1(exponent) - exponent) / values**2
        Gamma[:, 1:, :1] = (back * twice[:, None, :]) @ forth.transpose(0, 2, 1) @ push
        return Phi, Gamma


def _grid(count: int) -> _Grid:
    return next(grid for grid in (_FINE, _COARSE) if grid.size + 2 == count)


@cache
def memory_rates(count: int) -> Array:
    """Rates of the memory's integrals [1/s], slowest first; the first and last stand for all slower and faster ones."""
    grid = _grid(count)
    middle = grid.slowest * np.exp(grid.step * np.arange(grid.size))
    rates = np.concatenate([[0.0], middle, [middle[-1] * np.exp(2.0 * grid.step)]])
    rates.flags.writeable = False
    return rates


def memory_weights(nu: Any, count: int) -> list[Any]:
    """Weights of the memory's integrals [s^(nu-1)] for an order, a number or a CasADi expression."""
    # Plain numbers: CasADi expressions do not mix with numpy's, and CasADi's own functions of numbers are slow.
    grid, rates = _grid(count), memory_rates(count).tolist()
    of: Any = math if isinstance(nu, float | int) else casadi
    scale = of.sin(math.pi * nu) / math.pi * grid.step
    # The rule omits geometric series at both ends: slower rates count as constant, and faster ones,
    # which have long settled, by what they add at rest.
    down, up = of.exp(-(1.0 - nu) * grid.step), of.exp(-nu * grid.step)
    slower = scale * rates[1] ** (1.0 - nu) * down / (1.0 - down)
    faster = scale * rates[-2] ** (-nu) * up / (1.0 - up) * rates[-1]
    return [slower, *(scale * rate ** (1.0 - nu) for rate in rates[1:-1]), faster]
