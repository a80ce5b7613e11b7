"""The observer while the robot runs: one sample at a time, the same arithmetic as on a log."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from estimation.external_forces.online.step_functions import StepErrors, StepFunction
from estimation.external_forces.residuals.dynamics import dynamics_of
from estimation.external_forces.residuals.friction_levels import FRICTION_MEMORY, contact_weight
from estimation.external_forces.residuals.signals import SETTLING_CONSTANTS
from estimation.external_forces.thresholds.calibrations import Calibration
from estimation.external_forces.wrenches import tool_load
from estimation.models.model import Model
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.thermal import ThermalModel
from robots.thermal.online import OnlineFriction

HEAT_STEP = 1.0
"""Time over which the friction's power is averaged [s]: short against the time constants of a joint."""


@dataclass(frozen=True, eq=False)
class Reading:
    """What the observer says of one sample.

    Attributes:
        t: time [s].
        torque: external joint torque (n,) [N m or N].
        deviation: its standard deviation on a healthy robot (n,) [N m or N].
        statistic: squared distance of the torque from zero, over the threshold.
        contact: from when it exceeds 1, with the observer settled, until it has not for the observer's memory.
        jacobian: of the tool point in the base frame (6, n).
        q: positions (n,) [rad or m].
        calibration: of the observer.
    """

    t: float
    torque: Array
    deviation: Array
    statistic: float
    contact: bool
    jacobian: Array
    q: Array
    calibration: Calibration

    @property
    def force(self) -> tuple[Array, Array]:
        """Force at the tool in the base frame, if there is no moment, and its covariance: (3,) [N], (3, 3) [N2]."""
        return self._load(3)

    @property
    def wrench(self) -> tuple[Array, Array]:
        """Force and moment at the tool in the base frame, and their covariance: (6,) [N, N m], (6, 6)."""
        return self._load(6)

    def _load(self, rows: int) -> tuple[Array, Array]:
        covariance = self.calibration.errors.covariance(self.deviation)
        load, spread = tool_load(self.torque[None], covariance[None], self.jacobian[None, :rows])
        return load[0], spread[0]


class ForceObserver:
    """Estimates external forces sample by sample.

    Args:
        model: an identified model without extensions.
        calibration: of `estimate_forces` with ``velocity="logged"``, on a log with the velocities of this stream.
        tool: position (3,) of the tool point in the flange's frame [m]; the flange by default.
        gravity: (3,) in the base frame [m/s2], where the base stands otherwise than described.
        payload: ten inertial parameters of a body on the flange.
        thermal: each joint's thermal model (n,), None for a joint without; the power of its friction is averaged over a
            second.

    Raises:
        InputError: a model with extensions or without inertial parameters, or a calibration that does not suit it.
    """

    def __init__(
        self,
        model: Model,
        calibration: Calibration,
        *,
        tool: Sequence[float] | None = None,
        gravity: ArrayLike | None = None,
        payload: ArrayLike | None = None,
        thermal: Sequence[ThermalModel | None] = (),
    ) -> None:
        if model.extensions:
            raise InputError(
                "a model with extensions cannot be followed sample by sample",
                remedy="use the base model (of oed identify), or oed force on logs",
            )
        self.n = model.robot.n
        if calibration.velocity != "logged":
            raise InputError(
                "the calibration was made with smoothed velocities, which a stream does not have",
                remedy="calibrate with --velocity logged on a log with dq1..",
            )
        if len(calibration.errors.level) != self.n or (thermal and len(thermal) != self.n):
            raise InputError(
                f"a calibration of {len(calibration.errors.level)} joints, {len(thermal)} thermal models",
                allowed=f"{self.n}",
            )
        self.calibration = calibration
        self._step = StepFunction(dynamics_of(model, gravity=gravity, payload=payload, tool=tool))
        self._errors = StepErrors(calibration.errors)
        self._sliding = calibration.errors.sliding
        self._constant, self._threshold = calibration.constant, calibration.threshold.value
        self._friction = [None if own is None else OnlineFriction(own, np.zeros(4), HEAT_STEP) for own in thermal]
        self.reset()

    @property
    def friction_excess(self) -> Array:
        """Excess of each joint's friction over the model's, as a share of it (n,)."""
        return self._cross / self._square

    def reset(
        self,
        temperatures: Sequence[ArrayLike | None] | None = None,
        friction_excess: ArrayLike | None = None,
    ) -> None:
        """Forgets everything, as before the first sample.

        Args:
            temperatures: of each joint's zones (n,) [degC], see `start_temperatures`; ambient temperature by default.
            friction_excess: of each joint (n,), as an earlier run left it; zero by default.
        """
        n = self.n
        self._square = np.array(self.calibration.friction_square)
        self._cross = self._square * (np.zeros(n) if friction_excess is None else np.asarray(friction_excess))
        self._t: float | None = None
        self._begun, self._touched = 0.0, -math.inf
        self._residual, self._acceleration = np.zeros(n), np.zeros(n)
        self._amplitudes = np.zeros((4, n))
        self._momentum, self._other, self._dq, self._before = np.zeros((4, n))
        self._factors, self._energy, self._gathered = np.ones(n), np.zeros(n), 0.0
        for j, online in enumerate(self._friction):
            if online is not None:
                online.reset(None if temperatures is None else temperatures[j])
                self._factors[j] = online.factor

    def update(self, t: float, q: ArrayLike, dq: ArrayLike | None, tau: ArrayLike) -> Reading:
        """Takes one sample.

        Args:
            t: time [s], later than that of the sample before.
            q: positions (n,) [rad or m].
            dq: velocities (n,) [rad/s or m/s].
            tau: measured joint torques (n,) [N m or N].

        Raises:
            InputError: values that are missing, not finite or of another number, or time that does not go on.
        """
        if dq is None:
            raise InputError("no velocities", allowed=f"{self.n} numbers [rad/s or m/s]", remedy="record dq as well")
        at, speed, measured = self._checked(q, dq, tau)
        if self._t is not None and not t > self._t:
            raise InputError(f"time {t} after {self._t}", allowed="times that increase")
        momentum, rest, friction, jacobian = self._step(at, speed)
        other = measured - rest - self._factors * friction
        constant, errors = self._constant, self._errors
        step = None if self._t is None else t - self._t
        if self._friction and step is not None:
            self._heat(friction * speed, step)
        if step is None or step > max(constant, 2.0 * self.calibration.period):
            self._begun, self._touched, fresh = t, -math.inf, True
            self._residual = np.zeros(self.n)
            self._acceleration = np.zeros(self.n)
        else:
            fresh = False
            a = math.exp(-step / constant)
            slides = np.minimum(np.abs(speed), np.abs(self._dq)) >= self._sliding
            external = (momentum - self._momentum) / step - (other + self._other) / 2.0
            mean = (friction + self._before) / 2.0
            levelled = external + mean * self._cross / self._square
            self._residual = a * self._residual + (1.0 - a) * levelled
            self._acceleration = a * self._acceleration + (1.0 - a) * (speed - self._dq) / step
        variance = self._step.variance(at, speed, self._acceleration) if errors.widens else None
        now = errors.amplitudes(speed, friction, variance)
        self._amplitudes = now.copy() if fresh else a * self._amplitudes + (1.0 - a) * now
        self._t, self._momentum, self._other, self._dq, self._before = t, momentum, other, speed, friction
        deviation = errors.deviation(self._amplitudes)
        statistic = errors.statistic(self._residual, deviation) / self._threshold
        if step is not None and not fresh:
            b = math.exp(-min(step, 2.0 * self.calibration.period) / FRICTION_MEMORY)
            counts = np.where(slides, (1.0 - b) * float(contact_weight(statistic)), 0.0)
            kept = np.where(slides, b, 1.0)
            self._cross = kept * self._cross - counts * external * mean
            self._square = kept * self._square + counts * mean * mean
        if statistic > 1.0 and t - self._begun > SETTLING_CONSTANTS * constant:
            self._touched = t
        contact = t - self._touched <= self.calibration.memory
        return Reading(t, self._residual, deviation, statistic, contact, jacobian, at, self.calibration)

    def _heat(self, power: Array, step: float) -> None:
        """Adds the energy of a step, and follows the temperatures once a second."""
        self._energy += np.maximum(power, 0.0) * step
        self._gathered += step
        while self._gathered >= HEAT_STEP:
            mean = self._energy / self._gathered
            for j, online in enumerate(self._friction):
                if online is not None:
                    self._factors[j] = online.heat_by(float(mean[j]))
            self._energy -= mean * HEAT_STEP
            self._gathered -= HEAT_STEP

    def _checked(self, *signals: ArrayLike) -> Array:
        """Gives q, dq and tau (3, n) as one array.

        Raises:
            InputError: see `update`.
        """
        try:
            array = np.array(signals, dtype=np.float64)
        except ValueError:
            array = np.zeros(0)
        if array.shape == (3, self.n) and np.isfinite(array).all():
            return array
        for name, values in zip(("q", "dq", "tau"), signals, strict=True):
            own = np.asarray(values, dtype=np.float64)
            if own.shape != (self.n,) or not np.isfinite(own).all():
                raise InputError(f"{name} is {own.tolist()}", column=name, allowed=f"{self.n} finite numbers")
        return array
