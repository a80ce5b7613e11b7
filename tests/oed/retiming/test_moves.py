import dataclasses
import pathlib

import numpy as np
import pytest
import ruckig
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import estimation
import oed
import robots
from oed.retiming import moves, plan_move
from robots.common.errors import InfeasibleError, InputError, SolverError

PERIOD = 0.004


@pytest.mark.slow
@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=200)
@given(
    seed=st.integers(0, 100_000),
    smallest=st.integers(-11, 0),
    wait=st.sampled_from([0.0, 0.5, 20.0]),
    straight=st.booleans(),
)
def test_a_move_goes_from_rest_to_rest_within_every_limit(limits, seed, smallest, wait, straight):
    """Moves of any size start and end at rest, keep every limit, stay between their ends, and fit the period."""
    rng = np.random.default_rng(seed)
    start, other = rng.uniform(limits.lower, limits.upper, size=(2, 6))
    end = start + (other - start) * 10.0 ** rng.uniform(smallest, 0, size=6)
    move = plan_move(limits, start, end, period=PERIOD, minimum_duration=wait, straight=straight)
    assert move is not None
    assert move.duration / PERIOD == pytest.approx(round(move.duration / PERIOD), abs=1e-6)
    assert move.duration >= wait - 1e-9
    q, dq, ddq = move.sample([0.0, move.duration])
    # Sums of some ten knots in double precision; jerks of 640 rad/s^3 make 1e-9 of a knot moved by 1e-12 s.
    np.testing.assert_allclose(q, [start, end], atol=1e-13)
    np.testing.assert_allclose(dq, 0.0, atol=1e-12)
    np.testing.assert_allclose(ddq, 0.0, atol=1e-9)
    t = np.unique(np.concatenate([np.linspace(0.0, move.duration, 500), move.breakpoints]))
    q, dq, ddq = move.sample(t)
    assert np.all(q >= np.minimum(start, end) - 1e-9)
    assert np.all(q <= np.maximum(start, end) + 1e-9)
    assert np.all(np.abs(dq) <= limits.velocity * (1 + 1e-9))
    assert np.all(np.abs(ddq) <= limits.acceleration * (1 + 1e-9))
    assert np.all(np.abs(6 * move.coefficients[:, :, 3]) <= limits.jerk * (1 + 1e-6))


def test_the_move_is_smooth(limits):
    """Position, velocity and acceleration are continuous at every breakpoint."""
    move = plan_move(limits, np.zeros(6), np.array([1.0, -0.5, 0.2, 1e-4, 0.0, -2.0]), period=PERIOD)
    inner = move.breakpoints[1:-1]
    # Times a nanosecond apart: velocities of 7, accelerations of 32 and jerks of 640 change nothing above 1e-6.
    for before, after in zip(move.sample(inner - 5e-10), move.sample(inner + 5e-10), strict=True):
        np.testing.assert_allclose(before, after, atol=1e-6)


def test_a_long_move_takes_the_time_of_a_seven_segment_profile(limits):
    """A single joint that reaches its limits takes d/v + v/a + a/j, rounded up to the period."""
    end = np.array([2.5, 0.0, 0.0, 0.0, 0.0, 0.0])
    move = plan_move(limits, np.zeros(6), end, period=PERIOD)
    v, a, j = limits.velocity[0], 16.0, 320.0
    assert move.duration == pytest.approx(np.ceil((2.5 / v + v / a + a / j) / PERIOD) * PERIOD, abs=1e-12)


def test_a_straight_move_stays_on_the_chord(limits):
    """A straight move runs along the line between its ends; a free one is no slower to arrive."""
    end = np.array([1.0, -0.5, 0.2, 0.9, 0.0, -2.0])
    straight = plan_move(limits, np.zeros(6), end, period=PERIOD, straight=True)
    free = plan_move(limits, np.zeros(6), end, period=PERIOD)
    q, _, _ = straight.sample(np.linspace(0.0, straight.duration, 200))
    fraction = q[:, 5] / end[5]
    np.testing.assert_allclose(q, fraction[:, None] * end, atol=1e-12)
    assert free.duration <= straight.duration


def test_no_move_is_none_or_a_hold(limits):
    """Equal poses give no move, or, where a duration is asked for, a rest of that duration."""
    pose = np.full(6, 0.1)
    assert plan_move(limits, pose, pose, period=PERIOD) is None
    hold = plan_move(limits, pose, pose, period=PERIOD, minimum_duration=0.0101)
    assert hold.duration == pytest.approx(0.012)
    np.testing.assert_array_equal(hold.sample([0.005])[0], [pose])


def test_missing_acceleration_and_jerk_limits_get_defaults(limits):
    """Without acceleration and jerk limits a move keeps 4/s times the velocity and 20/s times that."""
    endless = dataclasses.replace(limits, acceleration=np.full(6, np.inf), jerk=np.full(6, np.inf))
    move = plan_move(endless, np.zeros(6), np.ones(6), period=PERIOD)
    _, _, ddq = move.sample(np.linspace(0.0, move.duration, 1000))
    assert np.all(np.abs(ddq) <= 4.0 * limits.velocity * (1 + 1e-9))
    assert np.abs(ddq / limits.velocity).max() > 3.0
    assert np.all(np.abs(6 * move.coefficients[:, :, 3]) <= 80.0 * limits.velocity * (1 + 1e-6))


def test_a_velocity_limit_of_zero_is_infeasible(limits):
    """A joint that may not move is named."""
    velocity = limits.velocity.copy()
    velocity[3] = 0.0
    with pytest.raises(InfeasibleError, match=r"joint 4.*velocity"):
        plan_move(dataclasses.replace(limits, velocity=velocity), np.zeros(6), np.ones(6), period=PERIOD)


def test_a_missing_velocity_limit_is_an_input_error(limits):
    """No default speed is safe."""
    velocity = limits.velocity.copy()
    velocity[1] = np.inf
    with pytest.raises(InputError, match=r"joint 2.*velocity limit"):
        plan_move(dataclasses.replace(limits, velocity=velocity), np.zeros(6), np.ones(6), period=PERIOD)


def test_poses_outside_the_limits_are_infeasible(limits):
    """A start or an end outside the position limits is an error with joint, value and range."""
    end = np.zeros(6)
    end[2] = 2.0
    with pytest.raises(InfeasibleError, match="joint 3: the position 2 rad"):
        plan_move(limits, np.zeros(6), end, period=PERIOD)


@pytest.mark.parametrize(
    ("end", "period"), [(np.zeros(5), PERIOD), (np.full(6, np.nan), PERIOD), (np.ones(6), 0.0), (np.ones(6), np.nan)]
)
def test_poses_and_period_are_checked(limits, end, period):
    """Poses of another size, NaN, and periods that are not positive are input errors."""
    with pytest.raises(InputError):
        plan_move(limits, np.zeros(6), end, period=period)


def test_nothing_is_ever_sent_to_a_service(limits, monkeypatch):
    """The planner is never given intermediate positions, which it would post to a web service."""
    seen = []
    planner_class = ruckig.Ruckig

    class Spy:
        def __init__(self, n):
            self.planner = planner_class(n)

        def calculate(self, problem, plan):
            seen.append((list(problem.intermediate_positions), problem.per_section_max_velocity))
            return self.planner.calculate(problem, plan)

    monkeypatch.setattr(moves.ruckig, "Ruckig", Spy)
    plan_move(limits, np.zeros(6), np.full(6, 0.5), period=PERIOD)
    plan_move(limits, np.zeros(6), np.full(6, 0.5), period=PERIOD, straight=True)
    assert seen == [([], None)] * 4


def test_no_source_file_touches_the_waypoints_of_ruckig():
    """No file of the package names the attribute that would go to the web service."""
    name = "intermediate" + "_positions"
    roots = (pathlib.Path(package.__file__).parent for package in (oed, estimation, robots))
    sources = [path for root in roots for path in root.rglob("*.py")]
    assert len(sources) > 10
    assert [path for path in sources if name in path.read_text(encoding="utf-8")] == []


def test_a_failing_planner_is_our_error(limits, monkeypatch):
    """What ruckig raises or returns in failure becomes a solver error."""

    class Broken:
        def __init__(self, n):
            pass

        def calculate(self, problem, plan):
            raise RuntimeError("no luck")

    monkeypatch.setattr(moves.ruckig, "Ruckig", Broken)
    with pytest.raises(SolverError, match="no luck"):
        plan_move(limits, np.zeros(6), np.ones(6), period=PERIOD)
    Broken.calculate = lambda self, problem, plan: ruckig.Result.ErrorInvalidInput
    with pytest.raises(SolverError, match="no move"):
        plan_move(limits, np.zeros(6), np.ones(6), period=PERIOD)


def test_an_overshooting_plan_is_refused():
    """A plan that leaves the range between its ends is an error: nothing else guards the position limits."""
    # q = 6 t^2 - 4 t^3 ... rises to 2 at t = 1, with q(1.5) = 0: the end.
    coefficients = np.array([[[0.0, 0.0, 6.0, -4.0]]])
    move = moves.PlannedMove(breakpoints=np.array([0.0, 1.5]), coefficients=coefficients)
    with pytest.raises(SolverError, match="joint 1: the planned move overshoots its ends by 2 rad"):
        moves._check_between(move, np.zeros(1), np.zeros(1))


@pytest.mark.parametrize("straight", [False, True])
def test_a_move_slows_down_where_the_speed_limit_falls_towards_an_end(straight):
    """Moves between the ends of the joints of a Franka FR3 keep its speed limits, which depend on the position."""
    limits = robots.load_robot("fr3").limits
    start, end = 0.98 * limits.lower + 0.02 * limits.upper, 0.02 * limits.lower + 0.98 * limits.upper
    move = plan_move(limits, start, end, period=0.001, straight=straight)
    q, dq, _ = move.sample(np.linspace(0.0, move.duration, 5001))
    ramp = limits.ramp
    # Its formula, written out (Franka Control Interface, limits of the joints).
    way = np.where(dq > 0, ramp.upper - q, q - ramp.lower)
    allowed = np.sqrt(2 * ramp.deceleration * way) - ramp.offset - ramp.reserve
    assert (np.abs(dq) <= np.minimum(limits.velocity, allowed) * (1 + 1e-3)).all()
    np.testing.assert_allclose(q[[0, -1]], [start, end], atol=1e-12)


def test_a_move_to_where_a_joint_may_not_move_is_refused():
    """The end of the range of a ramp allows no speed at all."""
    limits = robots.load_robot("fr3").limits
    edge = dataclasses.replace(limits, upper=limits.ramp.upper, lower=limits.ramp.lower)
    with pytest.raises(InfeasibleError, match="hardly move"):
        plan_move(edge, np.zeros(7) + edge.middle, edge.upper, period=0.001)
