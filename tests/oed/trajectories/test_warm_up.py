import dataclasses

import numpy as np
import pytest

from oed.trajectories import PiecewisePolynomial, WarmUp, plan_warm_up
from robots.common.errors import InfeasibleError, InputError
from robots.loading import load_robot

PERIOD = 0.004


def _khz(trajectory):
    return trajectory.sample(np.arange(0.0, trajectory.duration + 5e-4, 1e-3))


@pytest.fixture(scope="module")
def er3a():
    return load_robot("er3a").limits


def test_all_joints_use_all_their_rates_over_80_percent_of_their_ranges(er3a):
    """At 1 kHz each joint meets its velocity, acceleration and jerk limit to 0.1 %, passes none, and swings 80 %."""
    values = _khz(plan_warm_up(er3a, duration=60.0, period=PERIOD))
    for quantity, bound in ((values.dq, er3a.velocity), (values.ddq, er3a.acceleration), (values.dddq, er3a.jerk)):
        peaks = np.abs(quantity).max(axis=0)
        assert np.all((peaks >= 0.999 * bound) & (peaks <= bound))
    span = er3a.upper - er3a.lower
    np.testing.assert_allclose(values.q.max(axis=0), er3a.upper - 0.1 * span, atol=1e-3)
    np.testing.assert_allclose(values.q.min(axis=0), er3a.lower + 0.1 * span, atol=1e-3)


def test_over_the_whole_range_the_position_limits_are_met_and_not_passed(er3a):
    """With a fraction of one the position range is used to 0.1 % and not passed."""
    q = _khz(plan_warm_up(er3a, duration=20.0, period=PERIOD, fraction=1.0)).q
    span = er3a.upper - er3a.lower
    assert np.all((q.max(axis=0) <= er3a.upper) & (q.max(axis=0) >= er3a.upper - 1e-3 * span))
    assert np.all((q.min(axis=0) >= er3a.lower) & (q.min(axis=0) <= er3a.lower + 1e-3 * span))


def test_each_joint_has_its_own_period_and_all_end_together(er3a):
    """Joints cycle a whole number of times each, as many as fit, and rest where they started at the common end."""
    warm = plan_warm_up(er3a, duration=180.0, period=PERIOD)
    assert len(set(warm.repeats)) > 3
    for cycle, repeats, busy in zip(warm.cycles, warm.repeats, warm.busy, strict=True):
        assert cycle.duration * repeats == pytest.approx(180.0, abs=1e-9)
        fastest = busy * 180.0 / repeats
        assert (repeats + 1) * fastest > 180.0
    first, last = warm.sample([0.0]), warm.sample([180.0])
    np.testing.assert_allclose(first.q, last.q, atol=1e-12)
    np.testing.assert_allclose([last.dq, last.ddq], 0.0, atol=1e-10)


@pytest.mark.parametrize("duty", [0.2, 0.4, 0.6, 1.0])
def test_the_duty_is_what_the_velocities_say(er3a, duty):
    """The stated duty of each joint is the fraction of samples in which it moves; the mean is near what was asked."""
    warm = plan_warm_up(er3a, duration=180.0, period=PERIOD, duty=duty)
    moving = (np.abs(_khz(warm).dq) > 1e-9).mean(axis=0)
    # Each of up to 200 turns hides a sample or two of 180,000.
    np.testing.assert_allclose(moving, warm.busy, atol=3e-3)
    assert warm.mean_duty == pytest.approx(warm.busy.mean())
    assert warm.mean_duty == pytest.approx(duty, abs=0.025)


def test_pauses_are_shared_by_all_joints(er3a):
    """Below full duty, move and pause alternate: between the moves no joint moves."""
    warm = plan_warm_up(er3a, duration=60.0, period=PERIOD, duty=0.4, block=20.0)
    assert warm.starts.size == 4
    for start, following in zip(warm.starts[:-1], warm.starts[1:], strict=True):
        values = warm.sample(np.linspace(start + warm.move, following, 20))
        np.testing.assert_array_equal(values.dq, 0.0)
        assert np.ptp(values.q, axis=0).max() < 1e-14
        assert np.abs(warm.sample(np.linspace(start, start + warm.move, 500)).dq).max() > 1.0


def test_a_short_range_and_an_endless_joint_take_part(limits):
    """A joint whose range is too short for its speed goes as fast as it can; an endless one makes 80 % of a turn."""
    warm = plan_warm_up(limits, duration=20.0, period=PERIOD, centre=[0.0, 0.0, 5.0])
    assert warm.speeds[1] < 4.0
    np.testing.assert_allclose(warm.swing, [0.8 * 5.8, 0.4, 0.8 * 2 * np.pi], rtol=1e-8)
    q = _khz(warm).q
    assert (q[:, 2].min() + q[:, 2].max()) / 2 == pytest.approx(5.0, abs=1e-3)
    assert not [margin for margin in limits.margins(warm.motion(PERIOD)) if margin.violated]


def test_too_short_a_time_is_refused_with_what_would_do(limits):
    """A time too short for one cycle of the slowest joint is an error that says how long is needed, truly."""
    with pytest.raises(InputError, match="joint 1: one cycle takes") as caught:
        plan_warm_up(limits, duration=2.0, period=PERIOD)
    needed = float(caught.value.remedy.split()[-2])
    assert plan_warm_up(limits, duration=np.ceil(needed / PERIOD) * PERIOD, period=PERIOD).repeats[0] == 1


def test_what_makes_no_sense_is_refused(limits):
    """A zero limit, a duty out of range, an odd duration, and parts that do not fit one another are errors."""
    still = dataclasses.replace(limits, velocity=np.array([4.0, 0.0, 7.0]))
    with pytest.raises(InfeasibleError, match="joint 2: its velocity limit is 0"):
        plan_warm_up(still, duration=20.0, period=PERIOD)
    for duty in (0.0, 1.2, np.nan):
        with pytest.raises(InputError, match="duty"):
            plan_warm_up(limits, duration=20.0, period=PERIOD, duty=duty)
    with pytest.raises(InputError, match="multiple"):
        plan_warm_up(limits, duration=20.001, period=PERIOD)
    with pytest.raises(InputError, match="blocks"):
        plan_warm_up(limits, duration=20.0, period=PERIOD, duty=0.5, block=0.0)
    one = {"starts": [0.0, 2.0], "move": 1.0, "busy": [1.0], "swing": [0.0], "speeds": [0.0]}
    cycle = PiecewisePolynomial.hold([0.0], 0.5)
    for parts, message in (
        ({"cycles": (), "repeats": ()}, "repeats"),
        ({"cycles": (cycle,), "repeats": (3,)}, "fill"),
        ({"cycles": (cycle,), "repeats": (2,), "starts": [0.0, 0.9]}, "blocks"),
    ):
        with pytest.raises(InputError, match=message):
            WarmUp(**{**one, **parts})
