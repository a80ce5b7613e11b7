import dataclasses

import casadi
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oed.trajectories import Sinusoid, shortest_stroke_duration, velocity_reaching_stroke
from robots.common.errors import InfeasibleError, InputError


def test_one_way_is_thesis_equations_81_to_83():
    """The way there is eq. 81, and its derivatives by automatic differentiation are eq. 82, 83 and the jerk."""
    stroke = Sinusoid(start=np.array([0.3, -0.2]), joint=1, delta=1.4, stroke_duration=0.8)
    t = casadi.SX.sym("t")
    q = 0.3 + 1.4 * (t / 0.8 - casadi.sin(2 * casadi.pi * t / 0.8) / (2 * casadi.pi))
    dq = casadi.jacobian(q, t)
    ddq = casadi.jacobian(dq, t)
    oracle = casadi.Function("f", [t], [q, dq, ddq, casadi.jacobian(ddq, t)])
    times = np.linspace(0.0, 0.8, 33)
    values = stroke.sample(times)
    for index, time in enumerate(times):
        # Jerks reach 108 rad/s^3: 1e-12 is rounding.
        np.testing.assert_allclose([value[index, 0] for value in values], np.array(oracle(time)).ravel(), atol=1e-12)


def test_it_returns_and_other_joints_rest():
    """The way back mirrors the way there, speed reaches its peak both ways, and the other joints do not move."""
    stroke = Sinusoid(start=np.array([0.3, -0.2]), joint=1, delta=1.4, stroke_duration=0.8)
    t = np.linspace(0.0, 0.8, 201)
    there, back = stroke.sample(t), stroke.sample(1.6 - t)
    np.testing.assert_allclose(there.q, back.q, atol=1e-14)
    np.testing.assert_allclose(there.dq, -back.dq, atol=1e-13)
    assert there.dq.max() == pytest.approx(stroke.peak_velocity, rel=1e-12)
    assert back.dq.min() == pytest.approx(-stroke.peak_velocity, rel=1e-12)
    np.testing.assert_array_equal(there.q[:, 1], -0.2)
    np.testing.assert_array_equal(there.dq[:, 1], 0.0)


def test_it_rests_at_start_turn_and_end():
    """Velocity and acceleration are zero at the start, at the turn and at the end."""
    stroke = Sinusoid(start=np.zeros(1), joint=1, delta=-2.0, stroke_duration=0.6)
    _, dq, ddq, _ = stroke.sample([0.0, 0.6, 1.2])
    np.testing.assert_array_equal(dq, 0.0)
    np.testing.assert_array_equal(ddq, 0.0)


@given(delta=st.floats(1e-3, 20.0), scale=st.floats(0.01, 100.0))
def test_the_shortest_duration_keeps_every_limit_and_no_shorter_one_does(delta, scale):
    """The peaks at the duration returned are within the limits, and one period less would break one."""
    limits = _single(velocity=4.0 * scale, acceleration=16.0, jerk=320.0 / scale)
    period = 0.004
    duration = shortest_stroke_duration(limits, 1, delta, period)

    def usage(length: float) -> float:
        peaks = 2 * delta / length, 2 * np.pi * delta / length**2, 4 * np.pi**2 * delta / length**3
        return max(peaks[0] / (4.0 * scale), peaks[1] / 16.0, peaks[2] / (320.0 / scale))

    # Multiples met to 1e-9 periods count as met.
    assert usage(duration) <= 1.0 + 1e-7
    assert duration <= period * 1.001 or usage(duration - period) > 1.0
    assert duration / period == pytest.approx(round(duration / period), abs=1e-6)


def test_the_stroke_reaches_the_velocity_bound_both_ways_about_its_centre(limits):
    """Where the range allows it, the velocity bound is reached exactly, within the others, about the centre."""
    stroke = velocity_reaching_stroke(limits, 1, np.array([0.5, 0.0, 0.0]), period=0.004)
    assert stroke.peak_velocity == pytest.approx(4.0, rel=1e-12)
    values = stroke.sample(np.linspace(0.0, stroke.duration, 4001))
    assert np.abs(values.ddq).max() <= 16.0
    assert np.abs(values.dddq).max() <= 320.0
    # The middle of the stroke is the centre.
    assert (values.q[:, 0].min() + values.q[:, 0].max()) / 2 == pytest.approx(0.5, abs=1e-12)
    # One period less would break the acceleration bound: the stroke is the smallest.
    assert np.pi * 4.0 / (stroke.stroke_duration - 0.004) > 16.0


def test_the_stroke_is_shifted_into_the_range(limits):
    """Near a limit the stroke begins or ends there instead of crossing it."""
    high = velocity_reaching_stroke(limits, 1, np.array([2.8, 0.0, 0.0]), period=0.004)
    assert high.start[0] + high.delta <= 2.9
    assert high.start[0] + high.delta == pytest.approx(2.9, abs=1e-12)
    low = velocity_reaching_stroke(limits, 1, np.array([-2.8, 0.0, 0.0]), period=0.004)
    assert low.start[0] == -2.9
    assert low.peak_velocity == pytest.approx(4.0)


def test_a_short_range_is_used_whole(limits):
    """Where the range is too short for the velocity bound, the whole of it is used at the speed it gives."""
    stroke = velocity_reaching_stroke(limits, 2, np.zeros(3), period=0.004)
    assert stroke.delta == pytest.approx(0.5, abs=1e-15)
    assert stroke.start[1] == -0.2
    assert 1.0 < stroke.peak_velocity < 4.0
    assert stroke.stroke_duration == shortest_stroke_duration(limits, 2, 0.5, 0.004)


def test_an_endless_joint_strokes_about_its_centre(limits):
    """A joint without position limits reaches its bound too."""
    stroke = velocity_reaching_stroke(limits, 3, np.array([0.0, 0.0, 11.0]), period=0.004)
    assert stroke.peak_velocity == pytest.approx(7.0)
    assert stroke.start[2] + stroke.delta / 2 == pytest.approx(11.0)


def test_the_jerk_alone_can_decide(limits):
    """Without an acceleration limit the jerk limit sets the stroke, and is kept."""
    free = dataclasses.replace(limits, acceleration=np.full(3, np.inf))
    stroke = velocity_reaching_stroke(free, 1, np.zeros(3), period=0.004)
    assert stroke.peak_velocity == pytest.approx(4.0)
    assert np.abs(stroke.sample([0.0]).dddq).max() <= 320.0


def test_a_zero_velocity_limit_is_infeasible(limits):
    """A joint that may not move cannot stroke, and the error names it."""
    still = dataclasses.replace(limits, velocity=np.array([4.0, 0.0, 7.0]))
    with pytest.raises(InfeasibleError, match="joint 2: its velocity limit is 0"):
        velocity_reaching_stroke(still, 2, np.zeros(3), period=0.004)


def test_missing_limits_and_joints_are_refused(limits):
    """A joint that does not exist, a pose outside, and a joint without the limits that size the stroke are errors."""
    with pytest.raises(InputError, match="joint 4"):
        velocity_reaching_stroke(limits, 4, np.zeros(3), period=0.004)
    with pytest.raises(InputError, match="outside"):
        velocity_reaching_stroke(limits, 1, np.array([3.0, 0.0, 0.0]), period=0.004)
    endless = dataclasses.replace(limits, acceleration=np.full(3, np.inf), jerk=np.full(3, np.inf))
    with pytest.raises(InputError, match="acceleration or jerk limit"):
        velocity_reaching_stroke(endless, 1, np.zeros(3), period=0.004)
    with pytest.raises(InputError, match="joint 3"):
        Sinusoid(start=np.zeros(2), joint=3, delta=1.0, stroke_duration=1.0)
    with pytest.raises(InputError, match="positive time"):
        Sinusoid(start=np.zeros(2), joint=1, delta=1.0, stroke_duration=0.0)


def _single(velocity: float, acceleration: float, jerk: float):
    from robots.limits import Limits

    one = np.ones(1)
    return Limits(
        lower=-100 * one,
        upper=100 * one,
        velocity=velocity * one,
        acceleration=acceleration * one,
        jerk=jerk * one,
        torque=np.inf * one,
    )
