"""Heat balances written out once more, and general solvers for them: nothing of the package's numerics."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from math import gamma

import numpy as np
from scipy.integrate import solve_ivp

Power = Callable[[float], float]


def slope(name: str, p: dict[str, float], power: Power, ambient: float, drives: float = 1.0, T3: float | None = None):
    """The right-hand side of thesis eq. 99, 116 or 147."""

    def first(t, y):
        heat = power(t) * (p["alpha"] * (y[0] - p["T0"]) + p["beta"])
        return [(heat - p["K"] * (y[0] - ambient)) / p["C"]]

    def second(t, y):
        heat = power(t) * (p["alpha"] * (y[0] - p["T0"]) + p["beta"])
        through = p["K1"] * (y[0] - y[1])
        return [(heat - through) / p["C1"], (through - p["K2"] * (y[1] - ambient)) / p["C2"]]

    def advanced(t, y):
        total = power(t) * (p["alpha"] * (y[0] - p["T0"]) + p["beta"]) + p["W_e"] * drives
        third = (p["K13"] * y[0] + p["K23"] * y[1]) / max(p["K13"] + p["K23"], 1e-12) if T3 is None else T3
        one = total - p["K12"] * (y[0] - y[1]) - p["K13"] * (y[0] - third)
        two = p["K12"] * (y[0] - y[1]) - p["K23"] * (y[1] - third) - p["K2e"] * (y[1] - ambient)
        return [one / p["C1"], two / p["C2"]]

    return {"first": first, "second": second, "advanced": advanced}[name]


def integrate(name, p, power: Power, t, start, ambient=20.0, drives=1.0, T3=None, breaks=()):
    """Temperatures at times t by a general integrator, begun anew at breaks of the power."""
    f = slope(name, p, power, ambient, drives, T3)
    edges = np.unique([t[0], *breaks, t[-1]])
    values, state = np.empty((len(t), len(start))), np.asarray(start, dtype=float)
    for low, high in pairwise(edges):
        inside = (t >= low) & (t <= high)
        # A hair inside, so that the power at the edge is that of this piece.
        shrink = 1e-9 * (high - low)
        at, back = np.unique(np.clip(np.append(t[inside], high), low + shrink, high - shrink), return_inverse=True)
        result = solve_ivp(f, (low + shrink, high - shrink), state, t_eval=at, method="LSODA", rtol=1e-10, atol=1e-10)
        values[inside], state = result.y[:, back[:-1]].T, result.y[:, -1]
    return values


def fractional(p: dict[str, float], power: np.ndarray, t: np.ndarray, start: float, ambient: float = 20.0):
    """Caputo's equation by the product trapezoidal rule on the times given (Diethelm 2010), implicit.

    T(t) = T(0) + 1 / Gamma(nu) * integral (t - s)^(nu - 1) g(s) ds, g linear between the times; power (N,) in each.
    """
    nu, values, g = p["nu"], np.empty(len(t)), np.empty(len(t))

    def right(T, W):
        return (W * (p["alpha"] * (T - p["T0"]) + p["beta"]) - p["K"] * (T - ambient)) / p["C"]

    values[0], g[0] = start, right(start, power[0])
    for n in range(1, len(t)):
        a, b, h = t[n] - t[:n], t[n] - t[1 : n + 1], np.diff(t[: n + 1])
        zero = (a**nu - b**nu) / nu  # integral of the kernel over each step
        one = (a ** (nu + 1) - b ** (nu + 1)) / (nu + 1)
        late = (a * zero - one) / h  # weight of the value at each step's end
        early = zero - late
        known = start + (early @ g[:n] + late[:-1] @ g[1:n]) / gamma(nu)
        w = late[-1] / gamma(nu)
        gain = (power[n] * p["alpha"] - p["K"]) / p["C"]
        offset = (power[n] * (p["beta"] - p["alpha"] * p["T0"]) + p["K"] * ambient) / p["C"]
        values[n] = (known + w * offset) / (1.0 - w * gain)
        g[n] = gain * values[n] + offset
    return values
