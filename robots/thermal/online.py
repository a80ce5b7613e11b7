"""Friction and temperature while the robot runs: Algorithm 1 of the thesis, with an observer on torque residuals."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.thermal.base import ThermalModel


@dataclass(frozen=True, kw_only=True, eq=False)
class Step:
    """A heat balance over one time step, heat and surroundings constant in it.

        x+ = Phi x + around Te + driven drives + beside T3 + heat Q

    Attributes:
        period: the step [s].
        Phi: (s, s).
        around: (s,).
        driven: (s,).
        beside: (s,).
        heat: rise by 1 W (s,) [K].
    """

    period: float
    Phi: Array
    around: Array
    driven: Array
    beside: Array
    heat: Array


def discretise(model: ThermalModel, period: float, *, thermocouple: bool = False) -> Step:
    """Discretises a model without friction's feedback, which `OnlineFriction` closes implicitly.

    Args:
        model: the thermal model.
        period: the time step [s].
        thermocouple: whether T3 is measured.

    Raises:
        InputError: a period that is not positive.
    """
    if not (np.isfinite(period) and period > 0.0):
        raise InputError(f"thermal model: a period of {period} s", allowed="a positive time")
    third = 0.0 if thermocouple else None
    Phi, Gamma = model.transition(0.0, period, thermocouple=thermocouple)
    # Inputs enter linearly: each is what it adds to a balance of zeros.
    plain = replace(model, alpha=0.0, beta=1.0, ambient=0.0, reference=0.0)
    rest = plain.system(0.0, ambient=0.0, drives=0.0, T3=third)[1]
    beside = np.zeros(len(rest))
    if thermocouple:
        beside = plain.system(0.0, ambient=0.0, drives=0.0, T3=1.0)[1] - rest
    return Step(
        period=period,
        Phi=Phi,
        around=Gamma @ (plain.system(0.0, ambient=1.0, drives=0.0, T3=third)[1] - rest),
        driven=Gamma @ (plain.system(0.0, ambient=0.0, drives=1.0, T3=third)[1] - rest),
        beside=Gamma @ beside,
        heat=Gamma @ (plain.system(1.0, ambient=0.0, drives=0.0, T3=third)[1] - rest),
    )


@dataclass(frozen=True, kw_only=True)
class ObserverSettings:
    """How much a torque residual is believed.

    Attributes:
        torque_noise: standard deviation of the residual of the torque model without temperature [N m or N]; within one
            window it is taken not to average out.
        drift: of the temperatures beyond the model [K / sqrt(s)].
        window: time over which residuals are gathered before the temperatures are corrected [s].
        slowest: speed below which friction has no sure sign, and residuals do not count [rad/s or m/s].
    """

    torque_noise: float = 0.5
    drift: float = 0.01
    window: float = 1.0
    slowest: float = 0.02

    def __post_init__(self) -> None:
        for name in ("torque_noise", "window"):
            if not getattr(self, name) > 0.0:
                raise InputError(f"observer: {name} is {getattr(self, name)}", allowed="a positive number")
        for name in ("drift", "slowest"):
            if not getattr(self, name) >= 0.0:
                raise InputError(f"observer: {name} is {getattr(self, name)}", allowed="zero or a positive number")


class OnlineFriction:
    """Estimates a joint's friction and temperature step by step.

    Each step gives the friction of the temperature so far (line 1 of Algorithm 1), its power (line 2), and the
    temperatures that it leads to (line 3): exact for constant heat, the fall of friction within the step taken by the
    trapezoidal rule, so that any period is stable. Where a measured friction torque is given, a Kalman filter corrects
    the temperatures, once a window, from where they are unknown.

    Args:
        model: the joint's thermal model.
        coefficients: f1..f4 of the cold friction (4,).
        period: the controller's period [s].
        observer: how much measured torques are believed.
        thermocouple: whether T3 is given.
    """

    def __init__(
        self,
        model: ThermalModel,
        coefficients: ArrayLike,
        period: float,
        *,
        observer: ObserverSettings | None = None,
        thermocouple: bool = False,
    ) -> None:
        self.model = model
        self.coefficients = np.asarray(coefficients, dtype=np.float64)
        if self.coefficients.shape != (4,) or not np.isfinite(self.coefficients).all():
            raise InputError(f"cold friction of shape {self.coefficients.shape}", allowed="f1..f4, finite")
        self.observer = observer or ObserverSettings()
        self.thermocouple = thermocouple
        self.steps = round(max(self.observer.window / period, 1.0)) if period > 0 else 1
        self.short = discretise(model, period, thermocouple=thermocouple)
        self.long = discretise(model, period * self.steps, thermocouple=thermocouple)
        size, zones = model.state_count(), len(model.zones)
        unit = [model.zone_temperatures(model.values, list(row)) for row in np.eye(size)]
        self.readout: Array = np.array(unit, dtype=np.float64).T  # (z, s)
        begin = [model.start_state(list(row), size) for row in np.eye(zones)]
        self.begin: Array = np.array(begin, dtype=np.float64).T  # (s, z)
        self.reset()

    def reset(self, temperatures: ArrayLike | None = None, *, spread: float = 0.0) -> None:
        """Starts again.

        Args:
            temperatures: of the zones (z,) [degC]; ambient temperature by default.
            spread: how unsure they are [K]: some 20 after a restart of a robot that may be warm.

        Raises:
            InputError: other than one finite temperature a zone, or a negative spread.
        """
        zones = len(self.model.zones)
        T = np.full(zones, self.model.ambient) if temperatures is None else np.asarray(temperatures, dtype=np.float64)
        if T.shape != (zones,) or not np.isfinite(T).all() or not spread >= 0.0:
            raise InputError(
                f"start temperatures {T}, spread {spread}", allowed=f"{zones} finite numbers, zero or more"
            )
        self.state: Array = self.begin @ T
        self.covariance: Array = spread**2 * self.begin @ self.begin.T
        self.heat = 0.0
        self._clear()

    def _clear(self) -> None:
        self._cross = self._square = self._power = 0.0
        self._count = self._seen = 0

    @property
    def temperatures(self) -> Array:
        """Temperatures of the zones (z,) [degC]."""
        return self.readout @ self.state

    @property
    def factor(self) -> float:
        """Friction over that at T0."""
        return float(self.model.friction_factor(self.readout[0] @ self.state))

    @property
    def spread(self) -> float:
        """Standard deviation of the temperature where heat is produced [K], as the observer has it."""
        return float(np.sqrt(max(self.readout[0] @ self.covariance @ self.readout[0], 0.0)))

    def cold(self, dq: float) -> float:
        """Friction at T0 (thesis eq. 103) [N m or N]."""
        f1, f2, f3, f4 = self.coefficients
        return float(np.sign(dq) * f1 + dq * (f2 + abs(dq) * (f3 + abs(dq) * f4)))

    def step(
        self,
        dq: float,
        *,
        measured: float | None = None,
        ambient: float | None = None,
        drives: float = 1.0,
        T3: float = 0.0,
    ) -> float:
        """Advances by one period.

        Args:
            dq: joint velocity [rad/s or m/s].
            measured: friction torque of this sample: measured torque minus that of the rigid body [N m or N].
            ambient: ambient temperature [degC]; that of the model by default.
            drives: 1 where the drives are powered.
            T3: reading of the thermocouple, if there is one [degC].

        Returns:
            Friction torque at this velocity and temperature [N m or N]: what friction compensation adds.
        """
        cold = self.cold(dq)
        torque = cold * self.factor
        self._heat(max(cold * dq, 0.0), ambient, drives, T3)
        if measured is not None and np.isfinite(measured) and abs(dq) > self.observer.slowest:
            self._cross += measured * cold
            self._square += cold * cold
            self._seen += 1
        if self._count == self.steps:
            self._correct()
            self._clear()
        return torque

    def heat_by(self, power: float, *, ambient: float | None = None, drives: float = 1.0, T3: float = 0.0) -> float:
        """Advances by one period without a measurement, where the friction's power is known.

        Args:
            power: of the friction at T0, mean of the period [W].
            ambient: ambient temperature [degC]; that of the model by default.
            drives: 1 where the drives are powered.
            T3: reading of the thermocouple, if there is one [degC].

        Returns:
            Friction over that at T0 after it.
        """
        self._heat(max(power, 0.0), ambient, drives, T3)
        if self._count == self.steps:
            self._correct()
            self._clear()
        return self.factor

    def _heat(self, power: float, ambient: float | None, drives: float, T3: float) -> None:
        around = self.model.ambient if ambient is None else ambient
        self.state, heat = self._advance(self.short, self.state, power, around, drives, T3)
        self.heat += heat * self.short.period
        self._power += power
        self._count += 1

    def _feedback(self, step: Step, power: float) -> tuple[float, float]:
        """Slope of the heat with the mean temperature of a step [W/K], and the implicit denominator."""
        slope = power * self.model.alpha
        return slope, 1.0 - slope * float(self.readout[0] @ step.heat) / 2.0

    def _advance(
        self, step: Step, x: Array, power: float, ambient: float, drives: float, T3: float
    ) -> tuple[Array, float]:
        free = step.Phi @ x + step.around * ambient + step.driven * drives + step.beside * T3
        slope, under = self._feedback(step, power)
        middle = float(self.readout[0] @ (x + free)) / 2.0
        heat = (slope * (middle - self.model.T0) + power * self.model.beta) / under
        return free + step.heat * heat, heat

    def _correct(self) -> None:
        step, alpha = self.long, self.model.alpha
        slope, under = self._feedback(step, self._power / self._count)
        c = self.readout[0]
        F = step.Phi + np.outer(step.heat, slope / 2.0 * (c + c @ step.Phi) / under)
        P = F @ self.covariance @ F.T + self.observer.drift**2 * step.period * self.begin @ self.begin.T
        if self._seen and self._square > 0.0 and alpha != 0.0:
            h = alpha * c
            variance = self.observer.torque_noise**2 * self._seen / self._square
            Ph = P @ h
            gain = Ph / (float(h @ Ph) + variance)
            self.state = self.state + gain * (self._cross / self._square - self.factor)
            P = P - np.outer(gain, Ph)
        self.covariance = (P + P.T) / 2.0
