"""Heat of a motion: the friction's power sample by sample, and the temperatures that it makes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.thermal.base import ThermalModel

# A step of so many median steps is a pause between logs, in which the joint rests.
PAUSE_STEPS = 20.0


@dataclass(frozen=True, kw_only=True, eq=False)
class ThermalPath:
    """Thermal state of a joint during a motion.

    Attributes:
        t: times (N,) [s].
        temperatures: of the zones (N, z) [degC]; that where heat is produced comes first.
        factor: friction over that at T0 (N,).
        friction: torque of the friction (N,) [N m].
        power: that the friction turns into heat (N,) [W].
        energy: heat until each time (N,) [J].
        averaging_error: bound on what averaging the power over short times does to the temperatures [K].
    """

    t: Array
    temperatures: Array
    factor: Array
    friction: Array
    power: Array
    energy: Array
    averaging_error: float


def cold_friction(dq: ArrayLike, coefficients: ArrayLike) -> Array:
    """Friction at T0: f1 sign(dq) + f2 dq + f3 dq |dq| + f4 dq^3 (thesis eq. 103).

    Args:
        dq: joint velocities, (N,) or (N, n) [rad/s or m/s].
        coefficients: f1..f4, (4,) or (n, 4).

    Returns:
        Torques of the shape of dq [N m or N].
    """
    v = np.asarray(dq, dtype=np.float64)
    f1, f2, f3, f4 = np.moveaxis(np.asarray(coefficients, dtype=np.float64), -1, 0)
    return np.sign(v) * f1 + v * (f2 + np.abs(v) * (f3 + np.abs(v) * f4))


def friction_power(dq: ArrayLike, coefficients: ArrayLike) -> Array:
    """Power of the friction at T0, f1 |dq| + f2 dq^2 + f3 |dq|^3 + f4 dq^4 (thesis eq. 96).

    Args:
        dq: joint velocities, (N,) or (N, n) [rad/s or m/s].
        coefficients: f1..f4, (4,) or (n, 4).

    Returns:
        Powers of the shape of dq [W].
    """
    return np.asarray(cold_friction(dq, coefficients) * np.asarray(dq, dtype=np.float64))


def simulate_motion(
    model: ThermalModel,
    t: ArrayLike,
    dq: ArrayLike,
    friction: ArrayLike,
    *,
    ambient: ArrayLike | None = None,
    T3: ArrayLike | None = None,
    drives: ArrayLike = 1.0,
    start: ArrayLike | None = None,
    resolution: float = 1.0,
) -> ThermalPath:
    """Follows a joint through any motion.

    The power is averaged over `resolution`, keeping its energy, and the steps between are exact. Pauses between samples
    count as rests.

    Args:
        model: the joint's thermal model.
        t: increasing times (N,) [s].
        dq: joint velocity (N,) [rad/s or m/s].
        friction: torque that the friction would take at T0 (N,) [N m or N], see `cold_friction`.
        ambient: ambient temperature, a number or (N,) [degC]; that of the model by default.
        T3: reading of a thermocouple beside the joint (N,) [degC].
        drives: 1 where the drives are powered, a number or (N,).
        start: temperatures of the zones at first (z,) [degC]; ambient temperature by default.
        resolution: time over which the power is averaged [s].

    Returns:
        Temperatures, friction, power and energy at the given times.

    Raises:
        InputError: arrays of other shapes, times that do not increase, or a resolution that is not positive.
    """
    times, velocity, cold = (np.asarray(value, dtype=np.float64) for value in (t, dq, friction))
    if times.ndim != 1 or len(times) < 2 or velocity.shape != times.shape or cold.shape != times.shape:
        raise InputError(
            f"thermal model: a motion of shapes {times.shape}, {velocity.shape} and {cold.shape}",
            allowed="t, dq and friction of one shape (N,), N of two or more",
        )
    if not np.all(np.diff(times) > 0.0):
        raise InputError("thermal model: times that do not increase", allowed="increasing times [s]")
    if not resolution > 0.0:
        raise InputError(f"thermal model: a resolution of {resolution} s", allowed="a positive time")
    # A polynomial fitted to data may dip below zero where there were none; friction never gives power back.
    W = np.maximum(cold * velocity, 0.0)
    lengths = np.diff(times)
    moving = lengths <= PAUSE_STEPS * np.median(lengths)
    middle = np.where(moving, (W[1:] + W[:-1]) / 2.0, 0.0)
    heat = np.concatenate([[0.0], np.cumsum(middle * lengths)])
    count = max(1, int(np.ceil((times[-1] - times[0]) / resolution - 1e-9)))
    edges = np.linspace(times[0], times[-1], count + 1)
    steps = np.diff(edges)
    mean = np.diff(np.interp(edges, times, heat)) / steps
    centres = (edges[1:] + edges[:-1]) / 2.0
    around = None if ambient is None else _at(ambient, times, centres)
    temperatures = model.temperatures(
        np.maximum(mean, 0.0),
        steps,
        start=start,
        ambient=around,
        T3=None if T3 is None else _at(T3, times, centres),
        drives=_at(drives, times, centres),
    )
    inside = np.stack([np.interp(times, edges, column) for column in temperatures.T], axis=-1)
    factor = model.friction_factor(inside[:, 0])
    power = W * factor
    warm = np.where(moving, (power[1:] + power[:-1]) / 2.0, 0.0)
    index = np.minimum(((times[:-1] - times[0]) / resolution).astype(np.int64), count - 1)
    spread = np.bincount(index, np.abs(middle - mean[index]) * lengths, minlength=count)[:count] / steps
    return ThermalPath(
        t=times,
        temperatures=inside,
        factor=factor,
        friction=cold * factor,
        power=power,
        energy=np.concatenate([[0.0], np.cumsum(warm * lengths)]),
        averaging_error=float(spread.max() * model.rise(float(steps[0])) * max(factor.max(), 0.0)),
    )


def simulate_cycles(
    model: ThermalModel,
    t: ArrayLike,
    dq: ArrayLike,
    friction: ArrayLike,
    cycles: int,
    *,
    pause: float = 0.0,
    ambient: float | None = None,
    drives: float = 1.0,
    start: ArrayLike | None = None,
) -> ThermalPath:
    """Follows a joint through repetitions of one motion by its mean power: one exact step a cycle (thesis eq. 129).

    The temperatures ripple about those of the mean power. What one cycle's power above and below its mean could warm
    the joint by, had all of it stayed where it arose, bounds that ripple: `averaging_error`.

    Args:
        model: the joint's thermal model.
        t: increasing times of one cycle (N,) [s].
        dq: joint velocity (N,) [rad/s or m/s].
        friction: torque that the friction would take at T0 (N,) [N m or N].
        cycles: how often it is repeated.
        pause: rest after each cycle [s]: the duty cycle is the motion's share of the time.
        ambient: ambient temperature [degC].
        drives: 1 where the drives are powered.
        start: temperatures of the zones at first (z,) [degC].

    Returns:
        The state at the cycles' ends (cycles + 1,): power and friction are means over a cycle.

    Raises:
        InputError: arrays of other shapes, fewer than one cycle, or a negative pause.
    """
    times, velocity, cold = (np.asarray(value, dtype=np.float64) for value in (t, dq, friction))
    if cycles < 1 or not pause >= 0.0:
        raise InputError(f"{cycles} cycles with pauses of {pause} s", allowed="one or more, and zero or more seconds")
    if times.ndim != 1 or len(times) < 2 or velocity.shape != times.shape or cold.shape != times.shape:
        raise InputError(
            f"thermal model: a cycle of shapes {times.shape}, {velocity.shape} and {cold.shape}",
            allowed="t, dq and friction of one shape (N,), N of two or more",
        )
    W, lengths = np.maximum(cold * velocity, 0.0), np.diff(times)
    middle = (W[1:] + W[:-1]) / 2.0
    period = float(lengths.sum()) + pause
    mean = float(middle @ lengths) / period
    spread = (float(np.abs(middle - mean) @ lengths) + mean * pause) / period
    temperatures = model.temperatures(
        np.full(cycles, mean), period, start=start, ambient=ambient, drives=np.full(cycles, drives)
    )
    factor = model.friction_factor(temperatures[:, 0])
    level = float((np.abs(cold[1:]) + np.abs(cold[:-1])) @ lengths) / (2.0 * float(lengths.sum()))
    ends = times[0] + period * np.arange(cycles + 1)
    return ThermalPath(
        t=ends,
        temperatures=temperatures,
        factor=factor,
        friction=level * factor,
        power=mean * factor,
        energy=np.concatenate([[0.0], np.cumsum(mean * period * (factor[1:] + factor[:-1]) / 2.0)]),
        averaging_error=spread * model.rise(period) * float(max(factor.max(), 0.0)),
    )


def _at(value: ArrayLike, t: Array, centres: Array) -> Array:
    given = np.asarray(value, dtype=np.float64)
    if given.ndim == 0:
        return np.full(centres.shape, float(given))
    if given.shape != t.shape:
        raise InputError(f"thermal model: an input of shape {given.shape}", allowed=f"a number, or shape {t.shape}")
    return np.interp(centres, t, given)
