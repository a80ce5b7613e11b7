"""Reference motions that the robots are told to follow, as functions of time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline, PPoly

from tests.truth.machines import Machine


@dataclass(frozen=True, kw_only=True)
class Reference:
    """A motion: its duration [s], its period [s] or None, and a spline or a Fourier series behind it."""

    duration: float
    period: float | None
    kind: str
    curve: object

    def at(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Positions, velocities and accelerations (N, n) at times t; before and after it the robot stands still."""
        return self.curve.at(t)


@dataclass(frozen=True, kw_only=True)
class Fourier:
    """A Fourier series: centre (n,), amplitudes of cosine and sine (H, n), angular frequencies (H,)."""

    centre: np.ndarray
    cosine: np.ndarray
    sine: np.ndarray
    omega: np.ndarray

    def at(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The series and two derivatives."""
        c, s = np.cos(np.outer(t, self.omega)), np.sin(np.outer(t, self.omega))
        w = self.omega[:, None]
        q = self.centre + c @ self.cosine + s @ self.sine
        v = c @ (self.sine * w) - s @ (self.cosine * w)
        a = -c @ (self.cosine * w**2) - s @ (self.sine * w**2)
        return q, v, a


@dataclass(frozen=True, kw_only=True)
class Spline:
    """A spline at rest at both ends, and standing still outside."""

    curve: BSpline | PPoly
    start: float
    end: float

    def at(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The spline and two derivatives."""
        inside = np.clip(t, self.start, self.end)
        moving = ((t >= self.start) & (t <= self.end))[:, None]
        first, second = self.curve.derivative(1)(inside), self.curve.derivative(2)(inside)
        return self.curve(inside), np.where(moving, first, 0.0), np.where(moving, second, 0.0)


def draw_periodic(
    machine: Machine, rng: np.random.Generator, *, period: float = 10.0, cycles: int = 6, harmonics: int | None = None
) -> Reference:
    """Draws a Fourier motion that uses most of range, speed or acceleration, whichever ends first."""
    count = int(rng.integers(5, 8)) if harmonics is None else harmonics
    omega = 2 * np.pi / period * np.arange(1, count + 1)
    weight = (1.0 / np.arange(1, count + 1) ** 0.5)[:, None]
    shape = Fourier(
        centre=np.zeros(machine.n),
        cosine=rng.normal(size=(count, machine.n)) * weight,
        sine=rng.normal(size=(count, machine.n)) * weight,
        omega=omega,
    )
    q, v, a = shape.at(np.arange(0.0, period, 0.01))
    scale = _scale(machine, q, v, a, rng)
    middle = (machine.lower + machine.upper) / 2 - scale * (q.max(axis=0) + q.min(axis=0)) / 2
    curve = Fourier(
        centre=middle + rng.uniform(-0.05, 0.05, machine.n),
        cosine=shape.cosine * scale,
        sine=shape.sine * scale,
        omega=omega,
    )
    return Reference(duration=period * cycles, period=period, kind="periodic", curve=curve)


def draw_aperiodic(machine: Machine, rng: np.random.Generator, *, duration: float = 60.0) -> Reference:
    """Draws a quintic B-spline through random coefficients: smooth, never repeating, at rest at both ends."""
    step = float(rng.uniform(0.5, 1.0))
    spans = round(duration / step)
    knots = np.linspace(-5, spans + 5, spans + 11) * (duration / spans)
    free = spans - 5
    coefficients = np.zeros((spans + 5, machine.n))
    coefficients[5 : 5 + free] = rng.normal(size=(free, machine.n))
    # Six equal coefficients at an end are a robot that stands still there.
    coefficients[:6] = coefficients[5]
    coefficients[-6:] = coefficients[-6]
    shape = Spline(curve=BSpline(knots, coefficients, 5), start=0.0, end=duration)
    q, v, a = shape.at(np.arange(0.0, duration, 0.01))
    scale = _scale(machine, q, v, a, rng)
    middle = (machine.lower + machine.upper) / 2 - scale * (q.max(axis=0) + q.min(axis=0)) / 2
    curve = BSpline(knots, coefficients * scale + middle, 5)
    return Reference(
        duration=duration, period=None, kind="aperiodic", curve=Spline(curve=curve, start=0.0, end=duration)
    )


def _scale(machine: Machine, q: np.ndarray, v: np.ndarray, a: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    span = (machine.upper - machine.lower) / np.ptp(q, axis=0)
    speed, acceleration = machine.speed / np.abs(v).max(axis=0), machine.acceleration / np.abs(a).max(axis=0)
    return np.minimum.reduce([0.9 * span, 0.75 * speed, 0.95 * acceleration]) * rng.uniform(0.75, 1.0, machine.n)
