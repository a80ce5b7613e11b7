"""Forward dynamics of a robot under a position loop: the motion that a driving torque makes it make."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from robots.common.arrays import Array

Beyond = Callable[[Array, Array, Array], tuple[Array, Array]]

# The last pass may change the loop's torque by this share of it.
CONVERGED_CHANGE = 0.01
# An inertia below this share of what the loop is laid out for is filled up: no joint may accelerate without bound.
LEAST_INERTIA_SHARE = 0.05
# Beyond so many widths of the sign it is one.
SATURATED_WIDTHS = 6.0


@dataclass(frozen=True, kw_only=True)
class Loop:
    """A position loop: proportional and derivative feedback of each joint, sized by the joint's inertia.

    Attributes:
        bandwidth: undamped frequency of the error [Hz].
        damping: of the error; 1 is critical.
    """

    ENTRIES = ("bandwidth_hz=bandwidth", "damping")

    bandwidth: float = 5.0
    damping: float = 1.0

    def gains(self, inertia: Array) -> tuple[Array, Array]:
        """Gives stiffness and damping (n,) for joints of that inertia (n,)."""
        w = 2 * np.pi * self.bandwidth
        return w**2 * inertia, 2 * self.damping * w * inertia


@dataclass(frozen=True, kw_only=True, eq=False)
class Reference:
    """What the loop follows and what drives the robot besides, on an even grid.

    Attributes:
        step: sample period [s].
        q: wanted positions (N, n) [rad or m].
        dq: their velocities (N, n).
        ddq: their accelerations (N, n).
        torque: driving torque (N, n) [N m or N], to which the loop adds its own.
    """

    step: float
    q: Array
    dq: Array
    ddq: Array
    torque: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class Tangent:
    """How the robot's torque changes about the reference; it steers the passes, and does not change their limit.

    Attributes:
        inertia: (N, n, n).
        damping: d torque / d(dq) (N, n, n), without the sign's.
        stiffness: d torque / dq (N, n, n).
    """

    inertia: Array
    damping: Array
    stiffness: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class Driven:
    """The motion of the closed loop.

    Attributes:
        q: positions (N, n) [rad or m].
        dq: velocities (N, n).
        ddq: accelerations (N, n).
        correction: torque that the loop adds (N, n) [N m or N].
        passes: how often the motion was followed; one that diverges is followed no further.
        change: of the correction in the last pass, over itself.
        filled: inertia (n,) that the loop feeds back where the model has less than none; zero elsewhere.
    """

    q: Array
    dq: Array
    ddq: Array
    correction: Array
    passes: int
    change: float
    filled: Array

    @property
    def converged(self) -> bool:
        """Whether the last pass confirmed the one before."""
        return bool(self.change <= CONVERGED_CHANGE)


def drive(
    reference: Reference,
    resistance: Beyond,
    tangent: Tangent,
    *,
    inertia: Array,
    sign_width: Array,
    loop: Loop | None = None,
    passes: int = 25,
) -> Driven:
    """Follows a robot that is driven by a torque and held to its reference by a loop.

    The robot obeys torque(q, dq, ddq) = driving torque + loop(q_ref - q, dq_ref - dq). Time runs by the implicit
    midpoint rule, samples being the middles of its steps, the direction of friction by the backward rule, so that a
    joint sticks where it should. Whatever the torque depends on, the past included, is evaluated along the motion of
    the pass before (waveform relaxation), and passes go on until the motion confirms itself.

    Args:
        reference: N samples of n joints.
        resistance: the robot's torque along a motion (q, dq, ddq), each (N, n): the part that does not turn round with
            the velocity (N, n), and the size of the part that does (N, n), a factor of tanh(dq / sign_width).
        tangent: of the part that does not turn round.
        inertia: for which the loop is laid out (n,), above zero.
        sign_width: (n,) [rad/s or m/s].
        loop: its bandwidth and damping.
        passes: at most so many.

    Returns:
        The motion, converged or not.
    """
    h, r = reference.step, reference
    stiffness, damping = (loop or Loop()).gains(inertia)
    # A sign that is stated as sharp gets this width [rad/s or m/s].
    width = np.maximum(sign_width, 1e-6)
    filled = _filled(tangent.inertia, inertia)
    M, D, K = tangent.inertia, tangent.damping + np.diag(damping), tangent.stiffness + np.diag(stiffness)
    heavy = (M + np.diag(filled)) / h
    inverse = np.asarray(np.linalg.inv(heavy + D / 2 + K * (h / 4)), dtype=float)
    from_state = inverse @ np.concatenate([heavy - D / 2 - K * (h / 4), -K], axis=2)
    level = np.maximum(_rms(r.torque), 1e-12)
    held = r.torque + stiffness * r.q + damping * r.dq + filled * r.ddq
    q, dq, ddq = r.q, r.dq, r.ddq
    correction = np.zeros_like(q)
    change, done = np.inf, 0
    while done < passes and change > CONVERGED_CHANGE:
        done += 1
        smooth, turning = resistance(q, dq, ddq)
        sign = np.tanh(dq / width)
        # A friction that drives cannot be solved for: it is taken as it was.
        smooth = smooth + np.minimum(turning, 0.0) * sign
        known = smooth - _times(M, ddq) - _times(tangent.damping, dq) - _times(tangent.stiffness, q)
        with np.errstate(over="ignore", invalid="ignore"):  # of a motion that diverges, which is reported below
            q, dq, ddq = _follow(r, inverse, from_state, held - known, np.maximum(turning, 0.0), width)
            before, correction = correction, -stiffness * (q - r.q) - damping * (dq - r.dq) - filled * (ddq - r.ddq)
            # A correction counts as 0.1 % of the driving torque at least.
            size = np.maximum(_rms(correction), 1e-3 * level)
            change = float(np.max(_rms(correction - before) / size))
        # A motion whose loop adds so many times the driving torque is none.
        if not (size < 1e4 * level).all():
            change = np.inf
            break
    return Driven(q=q, dq=dq, ddq=ddq, correction=correction, passes=done, change=change, filled=filled)


def _rms(values: Array) -> Array:
    return np.asarray(np.sqrt(np.mean(values**2, axis=0)))


def _times(matrices: Array, vectors: Array) -> Array:
    return np.asarray((matrices @ vectors[:, :, None])[:, :, 0])


def _filled(matrices: Array, inertia: Array) -> Array:
    """Inertia (n,) that keeps every matrix's eigenvalues, over the loop's own inertia, above the least."""
    root = np.sqrt(inertia)
    lowest = float(np.linalg.eigvalsh((matrices + np.swapaxes(matrices, 1, 2)) / 2 / root[:, None] / root)[:, 0].min())
    return np.asarray(max(LEAST_INERTIA_SHARE - lowest, 0.0) * inertia)


def _follow(
    r: Reference, inverse: Array, from_state: Array, push: Array, turning: Array, width: Array
) -> tuple[Array, Array, Array]:
    """Steps through all samples: positions, velocities and accelerations (N, n) in the middle of each step."""
    h, n = r.step, r.q.shape[1]
    free = _times(inverse, push)
    drag = inverse * turning[:, None, :]
    velocities = np.empty((len(push) + 1, n))
    positions = np.empty_like(velocities)
    v = velocities[0] = r.dq[0] - h / 2 * r.ddq[0]
    q = positions[0] = r.q[0] - h / 2 * r.dq[0]
    state = np.concatenate([v, q])
    sharp, way = SATURATED_WIDTHS * width, np.sign(v)
    for k in range(len(push)):
        wanted = free[k] + from_state[k] @ state
        new = wanted - drag[k] @ way
        if (new * way < sharp).any():
            new = _turned(wanted, inverse[k], turning[k], width, new, way)
            way = np.sign(new)
        state[n:] += (h / 2) * (new + state[:n])
        state[:n] = v = new
        velocities[k + 1] = v
        positions[k + 1] = state[n:]
    middle = (velocities[1:] + velocities[:-1]) / 2
    return (positions[1:] + positions[:-1]) / 2, middle, np.diff(velocities, axis=0) / h


def _turned(wanted: Array, inverse: Array, turning: Array, width: Array, new: Array, way: Array) -> Array:
    """Solves v = wanted - inverse @ (turning tanh(v / width)) where `new`, by old ways, shows that joints turn.

    Joints that turn are solved for together, the others pull with all of their friction; those that turn in turn join
    them.
    """
    sharp = SATURATED_WIDTHS * width
    pull = turning * way
    active = np.zeros(len(new), dtype=bool)
    while True:
        turned = ~active & (new * way < sharp)
        if not turned.any():
            return new
        active |= turned
        own = np.flatnonzero(active)
        pull[own] = 0.0
        free = wanted - inverse @ pull
        if len(own) == 1:
            j = int(own[0])
            stiff, at = 1.0 / float(inverse[j, j]), float(free[j])
            pull[j] = stiff * (at - _solved(stiff, float(turning[j]), float(width[j]), stiff * at))
        else:
            B = np.asarray(np.linalg.inv(inverse[np.ix_(own, own)]), dtype=float)
            pull[own] = B @ (free[own] - _solved_together(B, turning[own], width[own], free[own]))
        new = wanted - inverse @ pull


def _solved_together(B: Array, turning: Array, width: Array, free: Array) -> Array:
    """Solves B v + turning tanh(v / width) = B free joint by joint, the others as they are (Gauss and Seidel)."""
    target, v = B @ free, np.zeros_like(free)
    count = len(v)
    # Sweeps over the joints whose friction changes its sign.
    for _ in range(30):
        largest = 0.0
        for j in range(count):
            x = float(target[j] - B[j] @ v + B[j, j] * v[j])
            value = _solved(float(B[j, j]), float(turning[j]), float(width[j]), x)
            largest = max(largest, abs(value - v[j]) / float(width[j]))
            v[j] = value
        # The velocity is solved for to this part of the sign's width.
        if largest < 1e-4:
            break
    return v


def _solved(b: float, f: float, w: float, x: float) -> float:
    """Solves b v + f tanh(v / w) = x for f >= 0.

    From a ramp's solution Newton's steps approach it from one side, for tanh bends one way.
    """
    if f <= 0.0:
        return x / b
    v = x / (b + f / w) if abs(x) <= b * w + f else (x - f if x > 0 else x + f) / b
    if abs(v) > SATURATED_WIDTHS * w:
        return v
    # Newton steps of one joint.
    for _ in range(12):
        s = math.tanh(v / w)
        step = (b * v + f * s - x) / (b + f / w * (1 - s * s))
        v -= step
        if abs(step) < 1e-6 * w:
            break
    return v
