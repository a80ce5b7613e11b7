"""The Mittag-Leffler function on the negative axis: the decay of a fractional model."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import expit

from robots.common.arrays import Array
from robots.common.errors import InputError


def mittag_leffler(x: ArrayLike, order: float) -> Array:
    """Gives E_nu(-x) = sum_k (-x)^k / Gamma(nu k + 1), which falls from 1 to 0 (thesis eq. 133).

        E_nu(-t^nu) = integral_0^1 exp(-t r(p)) dp,   r(p) = (sin(nu pi p) / sin(nu pi (1 - p)))^(1/nu)

    It is a mixture of exponentials; the form above holds for 0 < nu <= 1 and is as well-behaved next to nu = 1 as
    elsewhere.

    Args:
        x: zero or more, of any shape.
        order: nu, above 0 and at most 1.

    Returns:
        The values, of the same shape.

    Raises:
        InputError: a negative or not finite x, or an order out of range.

    Source:
        Gorenflo, Mainardi: Fractional calculus, 1997, with the spectral density integrated in closed form.
    """
    value = np.asarray(x, dtype=np.float64)
    if not np.all(np.isfinite(value) & (value >= 0.0)):
        raise InputError("Mittag-Leffler function: an argument is negative or not finite", allowed="x of zero or more")
    if not 0.0 < order <= 1.0:
        raise InputError(f"Mittag-Leffler function: order {order}", allowed="above 0 and at most 1")
    if order == 1.0:
        return np.exp(-value)
    with np.errstate(divide="ignore"):
        log_t = np.log(value).ravel() / order
    # Large arguments live on slow rates, which are at small p.
    # Trapezoidal rule in w, p = 1 / (1 + exp(-w)), as far as e^-40 of the weight.
    reach = 40.0
    slowest = reach + order * max(float(log_t.max(initial=0.0)), 0.0)
    # The error of a step is exp(-pi^2 / step).
    w = np.arange(-slowest, reach, 0.3 * order)
    p, rest = expit(w), expit(-w)
    weight = p * rest / (p * rest).sum()
    log_rate = (np.log(np.sin(order * np.pi * p)) - np.log(np.sin(order * np.pi * rest))) / order
    result = np.empty(log_t.shape)
    for start in range(0, len(log_t), 1024):
        part = slice(start, start + 1024)
        result[part] = np.exp(-np.exp(np.minimum(log_t[part, None] + log_rate, 7.0))) @ weight
    return result.reshape(value.shape)
