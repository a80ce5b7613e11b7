import dataclasses

import casadi
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from oed.trajectories import HarmonicSine, PiecewisePolynomial, Segment, Sequence, harmonic_sine_bounds
from robots.common.errors import InfeasibleError, InputError
from robots.limits import Limits


def _two(velocity=1e6, acceleration=1e6, jerk=1e9) -> Limits:
    one = np.ones(2)
    return Limits(
        lower=np.array([-1.0, -0.5]),
        upper=np.array([2.0, 0.5]),
        velocity=velocity * one,
        acceleration=acceleration * one,
        jerk=jerk * one,
        torque=np.inf * one,
    )


def _khz(trajectory):
    return trajectory.sample(np.arange(0.0, trajectory.duration, 1e-3))


def test_it_is_thesis_equations_72_to_74():
    """Position is eq. 72; by automatic differentiation its derivatives are eq. 73, 74 and the jerk."""
    amplitudes = np.array([[0.3, -0.2, 0.1], [0.5, 0.4, 0.3]])
    motion = HarmonicSine(amplitudes=amplitudes, base_frequency=0.3, multiples=(1, 2, 4))
    w, t = 2 * np.pi * 0.3, casadi.SX.sym("t")
    a = casadi.DM(amplitudes)
    q = a[:, 0] * casadi.sin(w * t) + a[:, 1] * casadi.sin(2 * w * t) + a[:, 2] * casadi.sin(4 * w * t)
    dq = casadi.jacobian(q, t)
    ddq = casadi.jacobian(dq, t)
    oracle = casadi.Function("f", [t], [q, dq, ddq, casadi.jacobian(ddq, t)])
    times = np.linspace(0.0, motion.duration, 29)
    values = motion.sample(times)
    for index, time in enumerate(times):
        for value, expected in zip(values, oracle(time), strict=True):
            # Jerks of some 200 rad/s^3 in double precision.
            np.testing.assert_allclose(value[index], np.array(expected).ravel(), atol=1e-11)


@settings(deadline=None)
@given(seed=st.integers(0, 1000), harmonics=st.integers(1, 6))
def test_the_bounds_hold_at_all_times_and_one_harmonic_meets_them(seed, harmonics):
    """The triangle inequality (eq. 64, 66, 69) bounds every quantity; for one harmonic it is the peak."""
    amplitudes = np.random.default_rng(seed).normal(size=(2, harmonics))
    motion = HarmonicSine(amplitudes=amplitudes, base_frequency=0.25, offsets=np.array([0.5, -1.0]))
    q, *rates = motion.sample(np.linspace(0.0, 4.0, 2001))
    for values, bound in zip([q - motion.offsets, *rates], motion.bounds(), strict=True):
        assert np.all(np.abs(values).max(axis=0) <= bound * (1 + 1e-12))
        if harmonics == 1:
            # A sample lies on each peak: 2000 is divisible by four.
            np.testing.assert_allclose(np.abs(values).max(axis=0), bound, rtol=1e-12)


def test_it_starts_with_the_speed_it_says_and_cannot_follow_a_rest():
    """The start velocity is the sum of a k w, and a sequence refuses to join it to a rest."""
    motion = HarmonicSine(amplitudes=np.array([[0.3, 0.2]]), base_frequency=0.25)
    w = np.pi / 2
    assert motion.start_velocity[0] == pytest.approx(0.3 * w + 0.2 * 2 * w)
    np.testing.assert_allclose(motion.sample([0.0, motion.duration]).dq[:, 0], motion.start_velocity[0], rtol=1e-12)
    parts = (PiecewisePolynomial.hold([0.0], 0.4), motion)
    with pytest.raises(InputError, match="velocity jumps"):
        Sequence(segments=tuple(Segment(kind="move", trajectory=part) for part in parts), period=0.004)


def test_the_bounds_are_thesis_equations_70_and_71():
    """A <= q_max / N, and k w <= min(dq_max/q_max, sqrt(ddq_max/q_max), cbrt(dddq_max/q_max))."""
    bounds = harmonic_sine_bounds(_two(velocity=3.0, acceleration=16.0, jerk=500.0), (1, 2, 4), [0.0, 0.0])
    np.testing.assert_allclose(bounds.amplitude, [1.0 / 3, 0.5 / 3], rtol=1e-8)
    np.testing.assert_allclose(bounds.frequency, [3.0, np.sqrt(32.0)], rtol=1e-12)
    jerky = harmonic_sine_bounds(_two(jerk=8.0), (1,), [0.0, 0.0])
    np.testing.assert_allclose(jerky.frequency, [2.0, np.cbrt(16.0)], rtol=1e-12)


def test_motion_within_the_bounds_keeps_every_limit():
    """Any amplitudes and frequencies within eq. 70 and 71 keep position, velocity, acceleration and jerk."""
    limits = _two(velocity=3.0, acceleration=16.0, jerk=500.0)
    bounds = harmonic_sine_bounds(limits, (1, 2, 4), [0.0, 0.0])
    base = bounds.frequency.min() / 4 / (2 * np.pi)
    motion = HarmonicSine(amplitudes=np.tile(bounds.amplitude[:, None], 3), base_frequency=base, multiples=(1, 2, 4))
    q, dq, ddq, dddq = _khz(motion)
    assert np.all(np.abs(q) <= [1.0, 0.5])
    assert np.abs(dq).max() <= 3.0
    assert np.abs(ddq).max() <= 16.0
    assert np.abs(dddq).max() <= 500.0


@pytest.mark.parametrize(
    ("quantity", "shares", "settings_"),
    [
        (1, [[1.0, 0.5], [0.0, 0.0]], {"velocity": 0.9}),
        (2, [[1.0], [-1.0]], {"acceleration": 2.0}),
        (3, [[0.2, 0.4], [-0.4, -0.4]], {"jerk": 1.5}),
    ],
)
def test_the_active_limit_is_met_and_not_passed(quantity, shares, settings_):
    """At 1 kHz the limit that decides is met to 0.1 % and not passed, nor is the position range."""
    motion = HarmonicSine.within(_two(**settings_), shares, period=0.004)
    values = _khz(motion)
    limit = next(iter(settings_.values()))
    peak = np.abs(values[quantity]).max()
    assert 0.999 * limit <= peak <= limit
    assert np.all(values.q <= [2.0, 0.5])
    assert np.all(values.q >= [-1.0, -0.5])


def test_one_harmonic_at_full_share_uses_the_whole_range():
    """About the middle of its range, a single harmonic reaches both position limits to 0.1 %, and passes neither."""
    q = _khz(HarmonicSine.within(_two(velocity=1.0), [[1.0], [1.0]], period=0.004)).q
    assert np.all((q.max(axis=0) <= [2.0, 0.5]) & (q.max(axis=0) >= [2.0 - 0.003, 0.5 - 0.001]))
    assert np.all((q.min(axis=0) >= [-1.0, -0.5]) & (q.min(axis=0) <= [-1.0 + 0.003, -0.5 + 0.001]))


def test_what_cannot_move_is_told():
    """No range, no rate limit, a zero limit, shares out of range and bad multiples are errors that name the joint."""
    limits = _two(velocity=1.0)
    endless = dataclasses.replace(limits, lower=np.array([-1.0, -np.inf]), upper=np.array([2.0, np.inf]))
    with pytest.raises(InputError, match="joint 2: moves without position limits"):
        HarmonicSine.within(endless, [[1.0], [1.0]], period=0.004)
    assert HarmonicSine.within(endless, [[1.0], [0.0]], period=0.004).bounds().q[1] == 0.0
    still = dataclasses.replace(limits, velocity=np.array([1.0, 0.0]))
    with pytest.raises(InfeasibleError, match="joint 2: its velocity limit is 0"):
        HarmonicSine.within(still, [[1.0], [1.0]], period=0.004)
    assert HarmonicSine.within(still, [[1.0], [0.0]], period=0.004).n == 2
    free = dataclasses.replace(limits, **{k: np.full(2, np.inf) for k in ("velocity", "acceleration", "jerk")})
    with pytest.raises(InputError, match="velocity, acceleration or jerk limit"):
        HarmonicSine.within(free, [[1.0], [1.0]], period=0.004)
    for shares in ([[1.5], [0.0]], [[0.0], [0.0]]):
        with pytest.raises(InputError, match="amplitudes lie outside"):
            HarmonicSine.within(limits, shares, period=0.004)
    with pytest.raises(InputError, match="joint 2: the offset"):
        HarmonicSine.within(limits, [[1.0], [1.0]], period=0.004, offsets=[0.0, 0.7])
    for multiples in ((2, 1), (1,), (0, 1), (1.5, 2)):
        with pytest.raises(InputError, match="multiples"):
            HarmonicSine(amplitudes=np.ones((1, 2)), base_frequency=1.0, multiples=multiples)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"offsets": np.zeros(3)}, "shapes"),
        ({"amplitudes": np.zeros((2, 0))}, "multiples"),
        ({"amplitudes": np.full((2, 2), np.nan)}, "finite"),
        ({"base_frequency": 0.0}, "base frequency"),
        ({"periods": 0}, "periods"),
    ],
)
def test_a_sum_that_makes_no_sense_is_refused(change, message):
    """Shapes that do not fit and numbers that are not positive are errors."""
    with pytest.raises(InputError, match=message):
        HarmonicSine(**{"amplitudes": np.zeros((2, 2)), "base_frequency": 1.0, **change})
