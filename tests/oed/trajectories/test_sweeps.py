import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from oed.trajectories import PiecewisePolynomial, Sweep, friction_sweep
from robots.common.errors import InfeasibleError, InputError
from robots.limits import Limits

PERIOD = 0.004


def _one(lower=-2.9, upper=2.9, velocity=4.0, acceleration=16.0, jerk=320.0) -> Limits:
    return Limits(*(np.array([value]) for value in (lower, upper, velocity, acceleration, jerk, np.inf)))


def _khz(trajectory):
    return trajectory.sample(np.arange(0.0, trajectory.duration + 5e-4, 1e-3))


def test_it_has_the_levels_of_the_thesis_both_ways_for_equal_times():
    """5, 20, 40, 60, 80 and 100 % of the velocity limit, up then down, for equal times at constant speed."""
    sweep = friction_sweep(_one(), 1, [0.0], period=PERIOD)
    assert [plateau.direction for plateau in sweep.plateaus] == [1, -1] * 6
    shares = [plateau.speed / 4.0 for plateau in sweep.plateaus[::2]]
    np.testing.assert_allclose(shares, [0.05, 0.2, 0.4, 0.6, 0.8, 1.0], rtol=1e-8)
    np.testing.assert_allclose([plateau.duration for plateau in sweep.plateaus], 1.0, atol=1e-12)
    assert not any(plateau.shortened for plateau in sweep.plateaus)
    assert {plateau.joint for plateau in sweep.plateaus} == {1}


def test_the_speed_is_constant_where_the_plateaus_say():
    """Between start and end of each plateau the velocity is the stated one, the acceleration zero; travel grows."""
    sweep = friction_sweep(_one(), 1, [0.3], period=PERIOD)
    travels = []
    for plateau in sweep.plateaus:
        values = sweep.sample(np.linspace(plateau.start + 1e-9, plateau.end - 1e-9, 50))
        np.testing.assert_allclose(values.dq, plateau.direction * plateau.speed, rtol=1e-12)
        # Rounding of the time, 3e-15 s, times the jerk.
        np.testing.assert_allclose(values.ddq, 0.0, atol=1e-11)
        just_outside = sweep.sample([plateau.start - 1e-3, plateau.end + 1e-3])
        assert np.all(np.abs(just_outside.dq) < plateau.speed)
        travels.append(np.ptp(values.q))
    assert np.all(np.diff(travels[::2]) > 0.0)
    # Travel is centred on the pose.
    q = sweep.sample([(p.start + p.end) / 2 for p in sweep.plateaus]).q
    np.testing.assert_allclose(q, 0.3, atol=1e-12)


@pytest.mark.parametrize("quantity", [1, 2, 3])
def test_velocity_acceleration_and_jerk_are_met_and_not_passed(quantity):
    """At 1 kHz each limit is reached to 0.1 % at full level, and not passed."""
    limits = _one()
    values = _khz(friction_sweep(limits, 1, [0.0], period=PERIOD))
    bound = (limits.velocity, limits.acceleration, limits.jerk)[quantity - 1][0]
    assert 0.999 * bound <= np.abs(values[quantity]).max() <= bound


def test_the_range_is_met_and_not_passed_and_then_the_time_shortens():
    """A plateau that the range cannot hold uses all of it, is shorter, and says so; slower ones keep their time."""
    limits = _one(lower=-1.0, upper=1.5)
    sweep = friction_sweep(limits, 1, [0.9], period=PERIOD, plateau=0.8)
    q = _khz(sweep).q
    assert 1.5 - 0.0025 <= q.max() <= 1.5
    assert -1.0 <= q.min() <= -1.0 + 0.0025
    for plateau in sweep.plateaus:
        needed = plateau.asked * 0.8 + plateau.asked * (plateau.asked / 16 + 0.05)
        if plateau.asked * 320 > 16**2:
            assert plateau.shortened == (needed > 2.5)
        assert plateau.speed == plateau.asked
        assert (plateau.duration < 0.8 - 1e-9) == plateau.shortened
    assert sweep.plateaus[-1].shortened
    assert not sweep.plateaus[0].shortened


def test_by_default_the_shorter_time_goes_to_every_level():
    """Without a time asked for, all levels get that of the fastest, so that they weigh the same."""
    sweep = friction_sweep(_one(lower=-1.0, upper=1.5), 1, [0.0], period=PERIOD)
    # 2.5 rad less two ramps of 4 * (4/16 + 16/320) / 2 rad at 4 rad/s.
    np.testing.assert_allclose([plateau.duration for plateau in sweep.plateaus], (2.5 - 1.2) / 4, rtol=1e-7)
    assert not any(plateau.shortened for plateau in sweep.plateaus)


def test_a_range_too_short_for_the_speed_lowers_it(limits):
    """Where even the ramps do not fit, the joint goes as fast as the range allows for a tenth of a second."""
    sweep = friction_sweep(limits, 2, np.array([0.5, 0.0, 1.0]), period=PERIOD)
    last = sweep.plateaus[-1]
    assert last.speed < last.asked
    assert last.shortened
    assert last.duration == pytest.approx(0.1, abs=1e-9)
    q = _khz(sweep).q
    assert 0.499 < np.ptp(q[:, 1]) <= 0.5
    np.testing.assert_array_equal(q[:, [0, 2]], np.tile([0.5, 1.0], (q.shape[0], 1)))


@settings(deadline=None, max_examples=30)
@given(
    width=st.floats(0.02, 20.0),
    velocity=st.floats(0.1, 10.0),
    acceleration=st.floats(1.0, 60.0),
    jerk=st.floats(20.0, 2000.0),
    place=st.floats(0.0, 1.0),
)
def test_any_joint_keeps_all_its_limits(width, velocity, acceleration, jerk, place):
    """Whatever range and limits, revolute or prismatic, nothing is passed at the controller's period, and it ends."""
    limits = _one(-width / 2, width / 2, velocity, acceleration, jerk)
    pose = (place - 0.5) * width * 0.999
    sweep = friction_sweep(limits, 1, [pose], period=PERIOD, levels=(0.1, 1.0), pause=0.05)
    margins = limits.margins(sweep.motion(PERIOD))
    assert not [margin for margin in margins if margin.violated]


def test_strokes_start_on_controller_periods_and_pause():
    """Each stroke starts on a controller period after a rest at least as long as asked for."""
    sweep = friction_sweep(_one(), 1, [0.0], period=PERIOD, levels=(1.0,), pause=0.5)
    ramp = 4.0 * (1 - 1e-9) / 16 + 0.05
    for plateau in sweep.plateaus:
        assert (plateau.start - ramp) / PERIOD == pytest.approx(round((plateau.start - ramp) / PERIOD), abs=1e-5)
    first = sweep.plateaus[0]
    values = sweep.sample(np.linspace(first.end + ramp + 1e-6, first.end + ramp + 0.499, 20))
    np.testing.assert_array_equal(values.dq, 0.0)


def test_what_cannot_be_swept_is_refused(limits):
    """A zero or missing limit, levels and times out of range, a pose outside and no such joint are errors."""
    pose = np.zeros(3)
    still = dataclasses.replace(limits, velocity=np.array([4.0, 0.0, 7.0]))
    with pytest.raises(InfeasibleError, match="joint 2: its velocity limit is 0"):
        friction_sweep(still, 2, pose, period=PERIOD)
    free = dataclasses.replace(limits, jerk=np.array([320.0, 320.0, np.inf]))
    with pytest.raises(InputError, match="joint 3: has no jerk limit"):
        friction_sweep(free, 3, pose, period=PERIOD)
    for levels in ((), (0.0, 1.0), (1.1,)):
        with pytest.raises(InputError, match="levels"):
            friction_sweep(limits, 1, pose, period=PERIOD, levels=levels)
    with pytest.raises(InputError, match="constant speed"):
        friction_sweep(limits, 1, pose, period=PERIOD, plateau=0.0)
    with pytest.raises(InputError, match="pause"):
        friction_sweep(limits, 1, pose, period=PERIOD, pause=-1.0)
    with pytest.raises(InputError, match="period"):
        friction_sweep(limits, 1, pose, period=0.0)
    with pytest.raises(InputError, match="joint 1: the pose 3 rad lies outside"):
        friction_sweep(limits, 2, [3.0, 0.0, 0.0], period=PERIOD)
    with pytest.raises(InputError, match="2 joints"):
        friction_sweep(limits, 2, [0.0, 0.0], period=PERIOD)
    for joint in (0, 4):
        with pytest.raises(InputError, match="joint does not exist"):
            friction_sweep(limits, joint, pose, period=PERIOD)
    path = PiecewisePolynomial.hold([0.0], 1.0)
    with pytest.raises(InputError, match="joint does not exist"):
        Sweep(pose=pose, joint=4, path=path, plateaus=())
    with pytest.raises(InputError, match="path of 2 joints"):
        Sweep(pose=pose, joint=1, path=PiecewisePolynomial.hold([0.0, 0.0], 1.0), plateaus=())
