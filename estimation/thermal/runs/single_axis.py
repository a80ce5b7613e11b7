"""Friction of one moving joint: the single-axis model, and sweeps at constant speed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from robots.common.arrays import Array
from robots.common.errors import InputError, NotIdentifiableError
from robots.thermal import cold_friction


@dataclass(frozen=True, kw_only=True, eq=False)
class SingleAxis:
    """tau = J ddq + Qa cos q - Qb sin q + friction(dq) (thesis eq. 89).

    Attributes:
        J: inertia of the joint with all that it carries [kg m2 or kg].
        Qa: gravity torque at q = 0 [N m].
        Qb: gravity torque at q = -90 deg [N m].
        coefficients: a0..a3 of the friction for dq > 0 and for dq < 0, (2, 4); alike unless they were fitted apart.
        standard_errors: of J, Qa, Qb and the coefficients that were fitted, as for white noise.
        residual_rms: of the torque [N m].
    """

    J: float
    Qa: float
    Qb: float
    coefficients: Array
    standard_errors: Array
    residual_rms: float

    def friction(self, dq: ArrayLike) -> Array:
        """Friction torque at velocities (N,) [N m]."""
        v = np.asarray(dq, dtype=np.float64)
        return np.where(v >= 0.0, *(cold_friction(v, row) for row in self.coefficients))

    def rigid(self, q: ArrayLike, ddq: ArrayLike) -> Array:
        """Torque of inertia and gravity (N,) [N m]."""
        angle = np.asarray(q, dtype=np.float64)
        return self.J * np.asarray(ddq, dtype=np.float64) + self.Qa * np.cos(angle) - self.Qb * np.sin(angle)


def fit_single_axis(
    q: ArrayLike, dq: ArrayLike, ddq: ArrayLike, tau: ArrayLike, *, each_direction: bool = False
) -> SingleAxis:
    """Fits J, Qa, Qb and a0..a3 by least squares (thesis eq. 90 to 94).

    Args:
        q: positions of the only joint that moves (N,) [rad].
        dq: velocities (N,) [rad/s].
        ddq: accelerations (N,) [rad/s2].
        tau: measured torques (N,) [N m].
        each_direction: whether friction has its own coefficients in each direction.

    Returns:
        The fit.

    Raises:
        InputError: arrays of other shapes.
        NotIdentifiableError: a motion that does not determine the effects separately, such as one at a single speed.
    """
    position, v, a, torque = _arrays(q, dq, ddq, tau)
    forward, backward = v > 0.0, v < 0.0
    shapes = np.stack([np.sign(v), v, v * np.abs(v), v**3], axis=1)
    friction = [shapes * forward[:, None], shapes * backward[:, None]] if each_direction else [shapes]
    Y = np.column_stack([a, np.cos(position), -np.sin(position), *friction])
    used = v != 0.0
    values, errors, rms = _least_squares(Y[used], torque[used], "a motion at several speeds both ways, over a range")
    rows = values[3:].reshape(-1, 4)
    return SingleAxis(
        J=float(values[0]),
        Qa=float(values[1]),
        Qb=float(values[2]),
        coefficients=np.stack([rows[0], rows[-1]]),
        standard_errors=errors,
        residual_rms=rms,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Sweep:
    """Friction at constant speeds, gravity removed.

    Attributes:
        t: middle of each stretch (P,) [s].
        speed: of each stretch (P,) [rad/s].
        friction: torque, signed as the speed (P,) [N m].
        standard_error: of the friction (P,) [N m].
        count: samples of each stretch (P,).
        Py: gravity torque with cos q [N m].
        Px: gravity torque with sin q [N m].
    """

    t: Array
    speed: Array
    friction: Array
    standard_error: Array
    count: Array
    Py: float
    Px: float


def sweep_friction(t: ArrayLike, q: ArrayLike, dq: ArrayLike, tau: ArrayLike, *, gravity: bool = True) -> Sweep:
    """Finds the stretches of constant speed and their friction, gravity removed by least squares (thesis eq. 84).

    Args:
        t: times (N,) [s].
        q: positions of the only joint that moves (N,) [rad].
        dq: velocities (N,) [rad/s].
        tau: measured torques (N,) [N m].
        gravity: False where the joint's axis stands upright.

    Returns:
        One friction value for each stretch.

    Raises:
        InputError: arrays of other shapes.
        NotIdentifiableError: no stretch of constant speed, or strokes too short to separate gravity from friction.
    """
    time, position, v, torque = _arrays(t, q, dq, tau)
    stretches = constant_speeds(v)
    if not stretches:
        raise NotIdentifiableError("no stretch of constant speed", remedy="record sweeps at constant speeds")
    owner = np.full(len(v), -1)
    for k, stretch in enumerate(stretches):
        owner[stretch] = k
    inside = owner >= 0
    dummies = np.eye(len(stretches))[owner[inside]]
    columns = [np.cos(position[inside]), np.sin(position[inside])] if gravity else []
    Y = np.column_stack([*columns, dummies])
    values, errors, _ = _least_squares(
        Y, torque[inside], "use longer strokes, or the same range at all speeds in both directions"
    )
    skip = len(columns)
    return Sweep(
        t=np.array([time[stretch].mean() for stretch in stretches]),
        speed=np.array([v[stretch].mean() for stretch in stretches]),
        friction=values[skip:],
        standard_error=errors[skip:],
        count=np.array([float(stretch.stop - stretch.start) for stretch in stretches]),
        Py=float(values[0]) if gravity else 0.0,
        Px=float(values[1]) if gravity else 0.0,
    )


def constant_speeds(dq: ArrayLike, *, steady: float = 0.02, shortest: int = 10) -> list[slice]:
    """Finds stretches in which a velocity keeps to its median.

    Args:
        dq: velocities (N,) [rad/s].
        steady: share of the median that it may differ by.
        shortest: number of samples.

    Returns:
        Slices, in order of time.
    """
    v = np.asarray(dq, dtype=np.float64)
    fast = np.abs(v) > 1e-3 * max(float(np.abs(v).max(initial=0.0)), 1e-12)
    # Steps between samples that are small against the speed: the candidates; each is then held to its own median.
    calm = np.concatenate([[False], np.abs(np.diff(v)) <= steady / 4.0 * np.abs(v[1:])]) & fast
    edges = np.flatnonzero(np.diff(np.concatenate([[False], calm, [False]]).astype(np.int8)))
    found = []
    for start, stop in zip(edges[::2], edges[1::2], strict=True):
        level = float(np.median(v[start:stop]))
        inside = np.flatnonzero(np.abs(v[start:stop] - level) <= steady * abs(level)) + start
        if not len(inside):
            continue
        longest = max(np.split(inside, np.flatnonzero(np.diff(inside) > 1) + 1), key=len)
        if len(longest) >= shortest:
            found.append(slice(int(longest[0]), int(longest[-1]) + 1))
    return found


def _arrays(*values: ArrayLike) -> tuple[Array, ...]:
    arrays = tuple(np.asarray(value, dtype=np.float64) for value in values)
    shape = arrays[0].shape
    if len(shape) != 1 or any(array.shape != shape for array in arrays):
        raise InputError(f"signals of shapes {[a.shape for a in arrays]}", allowed="one shape (N,)")
    if not all(np.isfinite(array).all() for array in arrays):
        raise InputError("signals that are not finite", allowed="finite numbers")
    return arrays


def _least_squares(Y: Array, tau: Array, remedy: str) -> tuple[Array, Array, float]:
    scale = np.sqrt(np.sum(Y**2, axis=0))
    if Y.shape[0] <= Y.shape[1] or not np.all(scale > 0.0):
        raise NotIdentifiableError(
            "the motion is too short, or gravity, inertia or friction has no influence", remedy=f"record {remedy}"
        )
    left, singular, right = np.linalg.svd(Y / scale, full_matrices=False)
    # Scaled columns this close to linear dependence are not separately determined.
    if singular[-1] < 1e-7 * singular[0]:
        raise NotIdentifiableError(
            "the motion does not determine gravity, inertia and friction separately", remedy=f"record {remedy}"
        )
    values = right.T @ ((left.T @ tau) / singular) / scale
    residual = tau - Y @ values
    variance = float(residual @ residual) / (Y.shape[0] - Y.shape[1])
    errors = np.sqrt(variance * np.sum((right / singular[:, None]) ** 2, axis=0)) / scale
    return values, errors, float(np.sqrt(np.mean(residual**2)))
