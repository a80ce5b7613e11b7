"""The observer's first-order filter, and the torque that changes the momentum within a step."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from robots.common.arrays import Array


def time_constant(bandwidth: float) -> float:
    """Gives the time constant [s] of a first-order filter of that bandwidth [Hz]."""
    return 1.0 / (2.0 * np.pi * bandwidth)


def restarts(t: Array, constant: float) -> NDArray[np.bool_]:
    """Marks samples (N,) at which the observer begins anew: the first, and those after a longer gap than it remembers.

    Args:
        t: times (N,) [s].
        constant: time constant of the filter [s].
    """
    steps = np.diff(t)
    usual = float(np.median(steps)) if len(steps) else 0.0
    return np.concatenate([[True], steps > max(constant, 2.0 * usual)])


def external_torque(t: Array, momentum: Array, other: Array, begins: NDArray[np.bool_]) -> Array:
    """Gives the mean external torque (N, n) of each step: change of the momentum less all other torque.

        u_k = (p_k - p_(k-1)) / dt - (s_k + s_(k-1)) / 2,  s = tau - beta

    Filtered, it is the residual of the generalised-momentum observer; no acceleration is needed.

    Args:
        t: times (N,) [s].
        momentum: p (N, n).
        other: s (N, n) [N m or N].
        begins: where (N,) the observer begins anew; zero there.
    """
    result = np.zeros_like(momentum)
    steps = np.diff(t)[:, None]
    result[1:] = np.diff(momentum, axis=0) / steps - (other[1:] + other[:-1]) / 2.0
    result[begins] = 0.0
    return result


def filtered(x: Array, t: Array, constant: float, begins: NDArray[np.bool_], *, from_zero: bool = False) -> Array:
    """Passes signals (N, ...) through y_k = a_k y_(k-1) + (1 - a_k) x_k, with a_k = exp(-dt / constant).

    Args:
        x: the signals.
        t: times (N,) [s].
        constant: time constant [s].
        begins: where (N,) the filter begins anew.
        from_zero: whether it begins with zero rather than with the signal.
    """
    result = np.empty_like(x)
    edges = [*np.flatnonzero(begins).tolist(), len(t)]
    for first, last in pairwise(edges):
        part = np.array(x[first:last])
        if from_zero:
            part[0] = 0.0
        result[first:last] = _run(part, np.diff(t[first:last]), constant)
    return result


def _run(x: Array, steps: Array, constant: float) -> Array:
    if not len(steps):
        return x
    decay = np.exp(-steps / constant)
    # Relative spread of the time steps up to which one coefficient serves all of them.
    if np.ptp(steps) <= 1e-6 * steps.mean():
        a = float(decay.mean())
        return np.asarray(lfilter([1.0 - a], [1.0, -a], x, axis=0, zi=a * x[None, 0])[0])
    y = np.array(x)
    for k, a in enumerate(decay.tolist(), start=1):
        y[k] = a * y[k - 1] + (1.0 - a) * x[k]
    return y
