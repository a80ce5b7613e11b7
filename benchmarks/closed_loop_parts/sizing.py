"""How much of an effect shows, and what a fit of its true form could know of it."""

from __future__ import annotations

from functools import cache

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.ndimage import minimum_filter1d
from scipy.signal import butter, lfilter, sosfiltfilt

from benchmarks.closed_loop_parts.plants import DURATION, EVERY, JOINTS, STEP, URDF, Plant, Ride, reference, ride

Array = NDArray[np.float64]

NOISE, MEMORY = 0.025, 0.9  # torque noise over the torque's RMS, half of it with this correlation of two rows
COUNT = 2 * np.pi / 2**19  # of the encoder [rad]
THIN = 4
BAND = 20.0  # [Hz]
STANDS, MEMORY_ROWS = 0.01, 13  # [rad/s], rows of 4 ms
CLOSE, TRIES = 0.06, 8
STARTS = {"backlash": 2e-3, "joint_elasticity": 5e-5, "base_compliance": 2e-5, "spring": 15.0}
POWERS = {"backlash": 0.7, "joint_elasticity": 1.0, "base_compliance": 1.0, "spring": 1.0}
RELATIVE = 0.03  # step of the derivative by the effect's size


@cache
def _model() -> pin.Model:
    return pin.buildModelFromUrdf(str(URDF))


def columns(motion: Ride) -> Array:
    """Evaluates pinocchio's regressor of rigid body, rotor, dry and viscous friction and offset (N, 6, p)."""
    model = _model()
    data = model.createData()
    rows = []
    for q, dq, ddq in zip(motion.q, motion.dq, motion.ddq, strict=True):
        own = [np.diag(ddq), np.diag(dq), np.diag(np.tanh(dq / 2e-3)), np.eye(JOINTS)]
        rows.append(np.hstack([pin.computeJointTorqueRegressor(model, data, q, dq, ddq), *own]))
    return np.array(rows)


def smooth(values: Array) -> Array:
    """Low-passes rows without delay, as a log of 250 Hz is looked at."""
    section = butter(2, BAND, fs=1.0 / (STEP * EVERY), output="sos")
    return np.asarray(sosfiltfilt(section, values, axis=0))


def error_left(motion: Ride) -> Array:
    """Returns the RMS (6,) of the torque that the best base model leaves, as a share of each joint's torque.

    Rows in which a joint stands do not count: dry friction holds any torque there, and a small change of the plant
    makes a joint stand for another time.
    """
    X, tau = smooth(columns(motion))[::THIN], smooth(motion.tau)[::THIN]
    size = np.sqrt(np.mean(motion.tau**2, axis=0))
    # A joint that stands within the filter's memory of a row.
    slowest = minimum_filter1d(np.abs(motion.dq), MEMORY_ROWS, axis=0)[::THIN]
    moves = np.where(slowest > STANDS, 1.0, 0.0)
    flat, wanted = (X * (moves / size)[:, :, None]).reshape(-1, X.shape[2]), (tau * moves / size).reshape(-1)
    left = (wanted - flat @ np.linalg.lstsq(flat, wanted, rcond=1e-10)[0]).reshape(-1, JOINTS)[25:-25]
    return np.asarray(np.sqrt(np.sum(left**2, axis=0) / np.sum(moves[25:-25], axis=0)))


def sized(plant: Plant, size: float) -> tuple[Plant, Ride, float]:
    """Searches the amount with which an effect shows as `size`, a share of a joint's torque.

    Returns:
        The plant, its motion, and the share that shows.
    """
    motion = reference(100 * plant.seed + plant.place, DURATION)
    none = error_left(ride(plant.of(0.0), motion))
    joint = None if plant.kind == "base_compliance" else plant.place - 1
    amount, power = STARTS[plant.kind], POWERS[plant.kind]
    for _ in range(TRIES):
        now = plant.of(amount)
        made = ride(now, motion)
        extra = np.sqrt(np.maximum(error_left(made) ** 2 - none**2, 0.0))
        shown = float(extra.max() if joint is None else extra[joint])
        if abs(shown / size - 1) < CLOSE:
            break
        amount *= float(np.clip((size / max(shown, 1e-4)) ** (1 / power), 0.2, 5.0))
    return now, made, shown


def noisy(motion: Ride, rng: np.random.Generator) -> tuple[Array, Array]:
    """Adds encoder counts and coloured torque noise."""
    q = np.round(motion.q / COUNT) * COUNT
    size = NOISE * np.sqrt(np.mean(motion.tau**2, axis=0)) * np.sqrt(0.5)
    white, driven = rng.normal(size=motion.tau.shape), rng.normal(size=motion.tau.shape)
    coloured = lfilter([np.sqrt(1 - MEMORY**2)], [1, -MEMORY], driven, axis=0)
    return q, motion.tau + size * (white + coloured)


def oracle_error(plant: Plant, made: Ride) -> float:
    """Returns the standard error of the effect's size where form and noise are known, and the base model is fitted.

    The derivative by the size is that of the torque beyond the base model's own, by two further integrations.
    """
    motion = reference(100 * plant.seed + plant.place, DURATION)
    sides = [ride(plant.of(plant.amount * (1 + way * RELATIVE)), motion) for way in (-1, 1)]
    X, size = columns(made), np.sqrt(np.mean(made.tau**2, axis=0))
    flat = (X / size[:, None]).reshape(-1, X.shape[2])
    values = np.linalg.lstsq(flat, (made.tau / size).reshape(-1), rcond=1e-10)[0]
    left = [side.tau - columns(side) @ values for side in sides]
    slope = (left[1] - left[0]) / (2 * RELATIVE * plant.amount)
    # The noise's spectrum: white plus coloured, whitened by its inverse root.
    f = np.arange(len(made.t) // 2 + 1) / len(made.t)
    power = 0.5 + 0.5 * (1 - MEMORY**2) / np.abs(1 - MEMORY * np.exp(-2j * np.pi * f)) ** 2

    def white(values: Array) -> Array:
        shaped = np.fft.rfft(values, axis=0) / np.sqrt(power).reshape(-1, *[1] * (values.ndim - 1))
        return np.asarray(np.fft.irfft(shaped, n=len(values), axis=0))

    scale = NOISE * size
    base = (white(X) / scale[:, None]).reshape(-1, X.shape[2])
    own = (white(slope) / scale).reshape(-1)
    apart = own - base @ np.linalg.lstsq(base, own, rcond=1e-10)[0]
    return float(1.0 / np.linalg.norm(apart))
