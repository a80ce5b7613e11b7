"""Reference motions of the robots, as functions of time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline, PPoly

from oed.benchmarks.truth.machines import Machine


@dataclass(frozen=True, kw_only=True)
class Reference:
    """A motion: its duration [s], its period [s] or None, its kind, and its spline or Fourier series."""

    duration: float
    period: float | None
    kind: str
    curve: Fourier | Spline

    def at(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Evaluates positions, velocities and accelerations (N, n) at times t (N,) [s]."""
        return self.curve.at(t)


@dataclass(frozen=True, kw_only=True)
class Fourier:
    """A Fourier series: centre (n,), amplitudes of cosine and sine (H, n), angular frequencies (H,) [rad/s]."""

    centre: np.ndarray
    cosine: np.ndarray
    sine: np.ndarray
    omega: np.ndarray

    def at(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Evaluates the series and its first two derivatives (N, n)."""
        c, s = np.cos(np.outer(t, self.omega)), np.sin(np.outer(t, self.omega))
        w = self.omega[:, None]
        q = self.centre + c @ self.cosine + s @ self.sine
        v = c @ (self.sine * w) - s @ (self.cosine * w)
        a = -c @ (self.cosine * w**2) - s @ (self.sine * w**2)
        return q, v, a


@dataclass(frozen=True, kw_only=True)
class Spline:
    """A spline with rest at both ends; outside, the robot is at rest there."""

    curve: BSpline | PPoly
    start: float
    end: float

    def at(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Evaluates the spline and its first two derivatives (N, n)."""
        inside = np.clip(t, self.start, self.end)
        moving = ((t >= self.start) & (t <= self.end))[:, None]
        first, second = self.curve.derivative(1)(inside), self.curve.derivative(2)(inside)
        return self.curve(inside), np.where(moving, first, 0.0), np.where(moving, second, 0.0)


def draw_periodic(
    machine: Machine, rng: np.random.Generator, *, period: float = 10.0, cycles: int = 6, harmonics: int | None = None
) -> Reference:
    """Draws a Fourier motion that uses most of the range, speed or acceleration, whichever is reached first."""
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
    """Draws a quintic B-spline with random coefficients: smooth, not periodic, at rest at both ends."""
    step = float(rng.uniform(0.5, 1.0))
    spans = round(duration / step)
    knots = np.linspace(-5, spans + 5, spans + 11) * (duration / spans)
    free = spans - 5
    coefficients = np.zeros((spans + 5, machine.n))
    coefficients[5 : 5 + free] = rng.normal(size=(free, machine.n))
    # With six equal coefficients at an end the robot is at rest there.
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


def draw_moves(machine: Machine, rng: np.random.Generator, *, duration: float = 60.0) -> Reference:
    """Draws moves between random points, of 0.8 to 2.5 s each, with pauses of up to 1 s, as in a production task."""
    times, points = [0.0, rng.uniform(0.3, 1.0)], [rng.normal(size=machine.n)] * 2
    while times[-1] < duration:
        times.append(times[-1] + rng.uniform(0.8, 2.5))
        points.append(rng.normal(size=machine.n))
        times.append(times[-1] + rng.uniform(0.02, 1.0))
        points.append(points[-1])
    begin, q = np.array(times), np.array(points)
    width, span = np.diff(begin)[:, None], np.diff(q, axis=0)
    # 10 u^3 - 15 u^4 + 6 u^5 in the relative time u of each piece, highest power first.
    powers = np.zeros((6, *span.shape))
    powers[0], powers[1], powers[2] = 6 * span / width**5, -15 * span / width**4, 10 * span / width**3
    powers[5] = q[:-1]
    shape = Spline(curve=PPoly(powers, begin), start=0.0, end=duration)
    scale = _scale(machine, *shape.at(np.arange(0.0, duration, 0.01)), rng)
    reach = q * scale
    middle = (machine.lower + machine.upper) / 2 - (reach.max(axis=0) + reach.min(axis=0)) / 2
    powers = powers * scale
    powers[5] += middle
    curve = Spline(curve=PPoly(powers, begin), start=0.0, end=duration)
    return Reference(duration=duration, period=None, kind="moves", curve=curve)


def _scale(machine: Machine, q: np.ndarray, v: np.ndarray, a: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    span = (machine.upper - machine.lower) / np.ptp(q, axis=0)
    speed, acceleration = machine.speed / np.abs(v).max(axis=0), machine.acceleration / np.abs(a).max(axis=0)
    return np.minimum.reduce([0.9 * span, 0.75 * speed, 0.95 * acceleration]) * rng.uniform(0.75, 1.0, machine.n)
