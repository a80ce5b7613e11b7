import dataclasses

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from scipy.optimize import approx_fprime

from oed.retiming.barrier import _quadratic, inside, shorten
from oed.retiming.limits import limit_usage
from oed.retiming.refinement import hermite_curve, refine
from oed.retiming.speed_law import SpeedGrid, SpeedLaw
from oed.retiming.timing_problem import TimingProblem
from robots.limits import Limits
from robots.signals import Motion

PERIOD = 0.004


def _polynomial_motion(shapes: list[Polynomial], duration: float) -> Motion:
    t = np.arange(round(duration / PERIOD) + 1) * PERIOD
    x = Polynomial([0.0, 1.0 / duration])
    columns = [[p(x).deriv(k)(t) if k else p(x)(t) for k in range(3)] for p in shapes]
    q, dq, ddq = np.array(columns).transpose(1, 2, 0)
    return Motion(t, q, dq, ddq)


def _bell(duration: float = 4.0, n: int = 6, seed: int = 0) -> Motion:
    """At rest without acceleration at both ends."""
    rng = np.random.default_rng(seed)
    x = Polynomial([0.0, 1.0])
    return _polynomial_motion([(x * (1 - x)) ** 3 * 30 * Polynomial(rng.normal(size=5)) for _ in range(n)], duration)


def test_the_curve_reproduces_polynomials_of_fifth_order():
    """Positions, velocities and accelerations of a quintic are met between the samples too."""
    motion = _polynomial_motion([Polynomial([0.3, -1.0, 2.0, 0.5, -1.5, 0.7])], 2.0)
    exact = Polynomial([0.3, -1.0, 2.0, 0.5, -1.5, 0.7])(Polynomial([0.0, 0.5]))
    s = np.linspace(0.0, 2.0, 777)
    # Second derivatives lose two factors of 1/h = 250 of double precision.
    for order, tolerance in ((0, 1e-13), (1, 1e-10), (2, 1e-8)):
        expected = exact.deriv(order)(s) if order else exact(s)
        np.testing.assert_allclose(hermite_curve(motion)(s, order)[:, 0], expected, atol=tolerance)


def test_a_constant_speed_is_inverted_exactly():
    """With x = 4 everywhere s = 2 t; with a stretch of 3 it takes thrice the time."""
    law = SpeedLaw(grid=SpeedGrid(length=2.0, intervals=7), coefficients=np.full(9, 4.0))
    t = np.linspace(0.0, 1.0, 13)
    for stretch in (1.0, 3.0):
        s, ds, dds = law.sample(stretch * t, stretch)
        np.testing.assert_allclose(s, 2.0 * t, atol=1e-13)
        np.testing.assert_allclose(ds, 2.0 / stretch, atol=1e-13)
        np.testing.assert_allclose(dds, 0.0, atol=1e-13)


def test_the_rates_of_a_law_are_derivatives_of_its_positions():
    """Central differences of s(t) give ds/dt, and of ds/dt give d2s/dt2."""
    rng = np.random.default_rng(3)
    law = SpeedLaw(grid=SpeedGrid(length=1.0, intervals=20), coefficients=rng.uniform(0.5, 2.0, size=22))
    duration, h = float(law.knots[1][-1]), 1e-5
    t = np.linspace(2 * h, duration - 2 * h, 301)
    (s0, ds0, _), (_, ds, dds), (s1, ds1, _) = law.sample(t - h), law.sample(t), law.sample(t + h)
    # d3s/dt3 and, at knots where it jumps, half a jump: below 2e3 here; times h.
    np.testing.assert_allclose((s1 - s0) / (2 * h), ds, atol=1e-6)
    np.testing.assert_allclose((ds1 - ds0) / (2 * h), dds, atol=2e-2)


def _problem(limits: Limits, *, torque: bool) -> TimingProblem:
    dynamics = (lambda q, dq, ddq: 3.0 * np.sin(q) + 0.5 * ddq + 0.1 * dq * np.roll(dq, 1, axis=1)) if torque else None
    friction = (lambda dq: np.tanh(dq / 0.02) + 0.3 * dq) if torque else None
    return TimingProblem(hermite_curve(_bell()), SpeedGrid(length=4.0, intervals=30), 100, limits, dynamics, friction)


@pytest.mark.parametrize("torque", [False, True])
def test_the_use_of_limits_and_its_gradients_agree(limits, torque):
    """Gradients of acceleration, jerk and torque with friction are those of finite differences."""
    problem = _problem(limits, torque=torque)
    c = np.random.default_rng(1).uniform(0.5, 1.5, size=problem.grid.size)
    use = problem.usage(c)
    np.testing.assert_allclose(use.values, problem.values(c), rtol=1e-12, atol=1e-14)
    for k in range(problem.grid.size):
        h = 1e-6
        step = np.where(np.arange(c.size) == k, h, 0.0)
        numeric = (problem.values(c + step) - problem.values(c - step)) / (2 * h)
        own = np.where((problem.columns == k)[:, None, :], use.gradients, 0.0).sum(axis=2)
        # Friction is differentiated one-sidedly with a relative step of 1e-6.
        np.testing.assert_allclose(own, numeric, atol=1e-5 * max(1.0, np.abs(numeric).max()))


def test_the_gradient_of_the_barrier_is_right(limits):
    """The gradient of duration and barrier is that of finite differences of the merit."""
    from oed.retiming.barrier import _merit

    problem = _problem(limits, torque=False)
    c = np.random.default_rng(2).uniform(0.09, 0.11, size=problem.grid.size)
    assert inside(problem, c)
    gradient, _ = _quadratic(problem, c, 10.0)
    numeric = approx_fprime(c, lambda x: _merit(problem, x, 10.0), 1e-8)
    np.testing.assert_allclose(gradient, numeric, rtol=1e-4, atol=1e-4 * np.abs(gradient).max())


def test_without_jerk_a_line_reaches_the_bang_bang_optimum(limits):
    """A straight path under a speed and an acceleration limit ends within a percent of d/v + v/a."""
    x = Polynomial([0.0, 1.0])
    line = _polynomial_motion([2.0 * x**4 * (35 - 84 * x + 70 * x**2 - 20 * x**3)], 4.0)
    one = np.ones(1)
    bounds = Limits(
        lower=-9 * one, upper=9 * one, velocity=2 * one, acceleration=10 * one, jerk=one * np.inf, torque=one
    )
    motion = refine(line, bounds, period=PERIOD)
    assert motion.duration == pytest.approx(2.0 / 2.0 + 2.0 / 10.0, rel=0.01)


def test_every_step_of_the_barrier_is_feasible_and_faster(limits):
    """What `shorten` returns keeps the limits strictly and takes less time."""
    problem = _problem(limits, torque=False)
    start = np.full(problem.grid.size, 0.1)
    better = shorten(problem, start)
    assert inside(problem, better)
    assert np.all(better > 0.0)
    before, after = (SpeedLaw(grid=problem.grid, coefficients=c).knots[1][-1] for c in (start, better))
    assert after < before


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("duration", [0.8, 20.0])
def test_refining_keeps_path_and_limits(limits, seed, duration):
    """From a timing too fast or too slow comes one that keeps every limit by its samples, on the same path."""
    given = _bell(duration, seed=seed)
    motion = refine(given, limits, period=PERIOD)
    assert max(float(use.max()) for use in limit_usage(motion, limits).values()) <= 1.0
    np.testing.assert_allclose(motion.q[[0, -1]], given.q[[0, -1]], atol=1e-12)
    np.testing.assert_allclose(motion.dq[[0, -1]], 0.0, atol=1e-9)
    np.testing.assert_allclose(motion.ddq[[0, -1]], 0.0, atol=1e-6)
    # Both timings of one path come to the same duration: it is the path that counts.
    other = refine(_bell(5.0, seed=seed), limits, period=PERIOD)
    assert motion.duration == pytest.approx(other.duration, rel=0.02)


def test_torque_with_friction_is_kept(limits):
    """A torque limit that binds is kept by the samples and nearly used, and makes the motion slower."""
    given = _bell(6.0)

    def rigid(q, dq, ddq):
        return 20.0 * np.sin(q) + 3.0 * ddq

    def friction(dq):
        return 2.0 * np.tanh(dq / 0.02) + 3.0 * dq

    tight = dataclasses.replace(limits, torque=np.full(6, 45.0))
    motion = refine(given, tight, period=PERIOD, inverse_dynamics=rigid, friction=friction)
    use = np.abs(rigid(motion.q, motion.dq, motion.ddq) + friction(motion.dq)).max() / 45.0
    assert 0.95 < use <= 1.0
    assert motion.duration > refine(given, limits, period=PERIOD).duration
    weak = dataclasses.replace(limits, torque=np.full(6, 1.0))
    assert refine(given, weak, period=PERIOD, inverse_dynamics=rigid, friction=friction) is None
