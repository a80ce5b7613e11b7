import numpy as np
import pytest
import ruckig
from hypothesis import given, settings
from hypothesis import strategies as st

from oed.trajectories.ramps import JointBounds, joined, stroke


def _bounds(velocity=4.0, acceleration=16.0, jerk=320.0) -> JointBounds:
    return JointBounds(lower=-np.inf, upper=np.inf, velocity=velocity, acceleration=acceleration, jerk=jerk)


@pytest.mark.slow
@settings(deadline=None)
@given(
    distance=st.floats(1e-4, 50.0),
    velocity=st.floats(0.1, 10.0),
    acceleration=st.floats(0.5, 50.0),
    jerk=st.floats(5.0, 2000.0),
)
def test_the_fastest_stroke_is_ruckigs(distance, velocity, acceleration, jerk):
    """At its highest speed a stroke takes the time that ruckig's time-optimal profile takes."""
    bounds = _bounds(velocity, acceleration, jerk)
    profile, _, _ = stroke(bounds, 0.2, 0.2 - distance, bounds.highest_speed(distance))
    problem, plan = ruckig.InputParameter(1), ruckig.Trajectory(1)
    problem.current_position, problem.target_position = [0.0], [distance]
    problem.max_velocity, problem.max_acceleration, problem.max_jerk = [velocity], [acceleration], [jerk]
    assert ruckig.Ruckig(1).calculate(problem, plan) == ruckig.Result.Working
    # Ruckig accepts what meets its target to 1e-8.
    assert profile.duration == pytest.approx(plan.duration, rel=1e-6)


@pytest.mark.slow
@settings(deadline=None)
@given(distance=st.floats(1e-3, 50.0), share=st.floats(0.01, 1.0), sign=st.sampled_from([-1, 1]))
def test_a_stroke_is_smooth_and_ends_where_it_should(distance, share, sign):
    """Position, velocity and acceleration have no jump, and the stroke rests at both of its ends."""
    bounds = _bounds()
    profile, begins, ends = stroke(bounds, 1.0, 1.0 + sign * distance, share * bounds.highest_speed(distance))
    path = joined([(0.0, profile)], profile.duration)
    inner = path.breakpoints[1:-1]
    before, after = path.sample(inner - 1e-10), path.sample(inner)
    for left, right, rate in zip(before[:3], after[:3], after[1:], strict=True):
        # A tenth of a nanosecond before it: its rate times that, and rounding.
        np.testing.assert_allclose(left, right, atol=1e-10 * np.abs(rate).max(initial=320.0) + 1e-12)
    rest = path.sample([0.0, path.duration])
    np.testing.assert_allclose(rest.q[:, 0], [1.0, 1.0 + sign * distance], atol=1e-12)
    # The slowest takes 1000 s, whose rounding of 1e-13 s comes times the jerk.
    np.testing.assert_allclose([rest.dq, rest.ddq], 0.0, atol=1e-10)
    if ends - begins > 1e-9:
        steady = path.sample(np.linspace(begins + 1e-10, ends - 1e-10, 5))
        np.testing.assert_allclose(steady.dq, sign * share * bounds.highest_speed(distance), rtol=1e-12)


@pytest.mark.parametrize("plateau", [0.0, 0.3])
def test_the_highest_speed_just_fits(plateau):
    """Ramps and plateau at the highest speed take the whole distance where the velocity limit does not decide."""
    bounds = _bounds()
    for distance in (1e-12, 1e-3, 0.1, 1.0):
        speed = bounds.highest_speed(distance, plateau)
        travel = 2 * bounds.ramp_distance(speed) + speed * plateau
        assert speed < 4.0
        assert travel <= distance
        assert travel == pytest.approx(distance, rel=1e-12)
    assert bounds.highest_speed(10.0, plateau) == 4.0
