"""Effects through the rigid body, against pinocchio's torque of the changed robot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from robots.geometry.chain import Chain
from robots.regressor import default_model
from robots.robot import Robot
from robots.terms.effects import EFFECTS
from robots.terms.effects.backlash import LANDING_TIME
from robots.terms.effects.base_tilt import level_axes
from robots.terms.effects.joint_elasticity import followed
from robots.terms.situations.situation import situation

STEP = 1e-5
SOME = slice(100, 1400, 65)


def _slope(torque, now, direction):
    """The central difference of pinocchio's torque along a change of q, dq and ddq, at some samples."""
    state = (now.q[SOME], now.dq[SOME], now.ddq[SOME])
    plus = torque(*(s + STEP * d for s, d in zip(state, direction, strict=True)))
    minus = torque(*(s - STEP * d for s, d in zip(state, direction, strict=True)))
    return (plus - minus) / (2 * STEP)


@pytest.fixture
def torque(now, twin):
    return lambda q, dq, ddq: twin(now.robot).torque(q, dq, ddq, now.robot.inertia)


def test_an_encoder_offset_moves_the_joint(now, torque):
    """An offset changes all torques as a joint that stands further does."""
    for joint in range(1, 6):
        step = np.eye(5)[joint - 1]
        expected = _slope(torque, now, (step, 0.0, 0.0))
        X = EFFECTS["encoder_offset"].columns(now, joint)
        np.testing.assert_allclose(X[SOME, :, 0], expected, rtol=1e-5, atol=1e-5)  # the difference's own error


@pytest.mark.slow
def test_an_elastic_gear_lets_its_link_lag(now, torque):
    """A stiff gear changes all torques as a link does that lags by its load, with its velocity and acceleration."""
    for joint in (1, 3, 5):
        spline = CubicSpline(now.t, now.load[:, joint - 1])
        step = -np.eye(5)[joint - 1]
        change = [spline(now.t[SOME], order)[:, None] * step for order in range(3)]
        # Large lags (c = 1) would leave the difference's range: it is scaled to the largest.
        size = max(float(np.abs(part).max()) for part in change)
        expected = _slope(torque, now, [part / size for part in change]) * size
        X = EFFECTS["joint_elasticity"].columns(now, joint, (1e9, 0.0, 0.05))[SOME, :, 0]
        # A spline's second derivative is of second order: (2 pi 4 Hz 4 ms)^2 / 12 at the motion's fastest products.
        assert np.abs(X - expected).max() < 2e-3 * np.abs(expected).max()


def test_a_tilt_may_leave_more_on_an_axis_along_gravity(random_robot):
    """Moments about a vertical first axis are not known from a level base; formulas else leave eight per cent."""
    robot = random_robot(4, 4)
    first = robot.chain.joints[0]
    assert first.kind == "revolute"
    down = first.rotation @ first.axis
    upright = replace(robot, chain=replace(robot.chain, gravity=tuple(-9.81 * down)))
    across = np.cross(down, np.eye(3)[int(np.argmin(np.abs(down)))])
    lying = replace(robot, chain=replace(robot.chain, gravity=tuple(9.81 * across / np.linalg.norm(across))))
    tilt = EFFECTS["base_tilt"]
    assert [tilt.leakage(upright, j) for j in range(3)] == [0.5, 0.08, 0.08]
    assert tilt.leakage(upright, 0, (1.0, 0.0)) == 0.08  # its own moments are reported
    assert tilt.leakage(lying, 0) == EFFECTS["spring"].leakage(upright, 0) == 0.08


def test_a_tilted_base_turns_gravity(now, twin):
    """A small tilt changes the torques as gravity from another direction does."""
    X = EFFECTS["base_tilt"].columns(now, None)
    axes = level_axes(np.array(now.robot.chain.gravity))
    np.testing.assert_allclose(axes @ axes.T, np.eye(2), atol=1e-12)
    for k, axis in enumerate(axes):
        torques = []
        for sign in (1, -1):
            # Seen from a base that turned by +angle, gravity turned by -angle.
            gravity = Rotation.from_rotvec(np.array(-sign * STEP * axis)).apply(np.array(now.robot.chain.gravity))
            tilted = Robot(
                name="tilted",
                chain=Chain(now.robot.chain.joints, gravity=gravity),
                limits=now.robot.limits,
                inertia=now.robot.inertia,
            )
            torques.append(twin(tilted).torque(now.q[SOME], now.dq[SOME], now.ddq[SOME], now.robot.inertia))
        expected = (torques[0] - torques[1]) / (2 * STEP)
        np.testing.assert_allclose(X[SOME, :, k], expected, rtol=1e-5, atol=1e-5)


def test_an_upright_axis_has_moments_that_a_tilt_shows(random_robot, twin):
    """A first link's moments, in no torque of a level robot, act on the first joint alone, as pinocchio has them."""
    robot = random_robot(4, 4)
    first = robot.chain.joints[0]
    assert first.kind == "revolute"
    down = first.rotation @ first.axis
    gravity = 9.81 * down
    bare = robot.inertia.copy()
    bare[0] = (2.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 1.0)
    # Moments along the level axes where the joint is at zero, in the frame of its link.
    axes, moments = level_axes(gravity), np.array([0.7, -0.4])
    inertia = bare.copy()
    inertia[0, 1:4] = first.rotation.T @ (moments @ axes)
    upright = replace(robot, chain=replace(robot.chain, gravity=tuple(gravity)))
    rng = np.random.default_rng(1)
    q, still = rng.uniform(-2, 2, (20, 4)), np.zeros((20, 4))
    model = default_model(upright)
    base = np.zeros(model.size)
    base[[i for i, c in enumerate(model.columns) if c.term == "rigid_body"]] = bare.ravel()
    now = situation(model, base, np.arange(20.0), q, still, still)
    X = EFFECTS["base_tilt"].columns(now, None, tuple(moments))
    without, level = (twin(upright).torque(q, still, still, own) for own in (bare, inertia))
    np.testing.assert_allclose(level, without, atol=1e-9)
    for k, axis in enumerate(axes):
        torques = []
        for sign in (1, -1):
            turned = Rotation.from_rotvec(-sign * STEP * axis).apply(gravity)
            tilted = replace(robot, chain=replace(robot.chain, gravity=tuple(turned)))
            torques.append(twin(tilted).torque(q, still, still, inertia))
        expected = (torques[0] - torques[1]) / (2 * STEP)
        assert np.abs(expected[:, 0]).max() > 1.0
        np.testing.assert_allclose(X[:, :, k], expected, rtol=1e-5, atol=1e-5)


def test_level_axes_are_x_and_y_of_an_upright_robot():
    """Where gravity is along z, the tilts are about x and y."""
    np.testing.assert_array_equal(level_axes(np.array([0.0, 0.0, -9.81])), [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


@pytest.mark.slow
def test_a_payload_is_a_body_on_the_flange(now, twin, catalogue_robot, seen):
    """A body's mass, moments and inertia change the torques as a heavier link does."""
    pin = pytest.importorskip("pinocchio")
    ours = [0, 1, 2, 3, 4, 5, 7, 6, 8, 9]  # pinocchio lists Iyy before Ixz
    for robot in (now.robot, catalogue_robot("ur10")):
        seen_by = seen(robot=robot)
        body = pin.Inertia(2.0, np.array([0.03, -0.05, 0.12]), np.diag([0.02, 0.03, 0.025]))
        heavier = np.array(robot.inertia)
        on_link = pin.SE3(np.array(robot.chain.tip)).act(body)
        heavier[-1] += on_link.toDynamicParameters()[ours]
        states = (seen_by.q[SOME], seen_by.dq[SOME], seen_by.ddq[SOME])
        expected = twin(robot).torque(*states, heavier) - twin(robot).torque(*states, robot.inertia)
        tool = seen_by.sensitivity("tool")
        got = tool[SOME] @ body.toDynamicParameters()[ours]
        np.testing.assert_allclose(got, expected, atol=1e-9 * np.abs(expected).max())
        X = EFFECTS["payload_change"].columns(seen_by, None, (3.0, 1.0))
        np.testing.assert_array_equal(X, np.where(seen_by.t[:, None, None] >= 3.0, tool, 0.0))


@pytest.mark.slow
@pytest.mark.parametrize("swing", [0.0, 0.5])
def test_a_soft_gear_keeps_its_link_behind(seen, swing):
    """The link's load is that of a mass, alike or changing, behind a spring, by an integrator of scipy."""
    now = seen(2, seed=2)
    load = np.sin(9.0 * now.t) + 0.3 * np.sin(31.0 * now.t)
    inertia = 2.0 + swing * np.sin(1.3 * now.t)
    stiffness = 2.0 * (2 * np.pi * 8.0) ** 2

    def rate(t, state):
        drive = np.sin(9.0 * t) + 0.3 * np.sin(31.0 * t)
        w = np.sqrt(stiffness / (2.0 + swing * np.sin(1.3 * t)))
        return [state[1], w**2 * (drive - state[0]) - 2 * 0.05 * w * state[1]]

    exact = solve_ivp(rate, (0, now.t[-1]), [0.0, 0.0], t_eval=now.t, rtol=1e-8, max_step=0.01).y[0]
    # The bilinear rule bends frequencies: at 31 rad/s of 4 ms by 0.1 %, near a resonance that answers a hundredfold.
    np.testing.assert_allclose(followed(now, load, stiffness, inertia), exact, atol=0.05)


def test_a_stiff_gear_follows_at_once(seen):
    """A resonance far above the samples' rate leaves the load as it is."""
    now = seen(2, seed=2)
    load = np.sin(9.0 * now.t)
    np.testing.assert_array_equal(followed(now, load, 1e9, np.ones(len(load))), load)


@pytest.mark.slow
def test_size_of_an_effect_tells_its_time(seen):
    """What follows from a coefficient is offered: the gap that is crossed, a delay's own reversals, a resonance."""
    now = seen(5, seed=1)
    bare = seen(5, seed=1, robot=replace(now.robot, rotor_inertia=np.zeros(5)))
    for known, at, count in ((True, now, 7), (False, bare, 15)):
        crossings = EFFECTS["backlash"].likely(at, 2, (1e-3, 0.2, 0.0, 0.03), np.array([2e-4]))
        assert crossings[0] == (4e-4, 0.0, 0.0, LANDING_TIME)
        assert len(set(crossings)) == count
        assert (None,) * 4 not in crossings
        assert ((None, None, 0.0, None) in crossings) is not known
    for name, joint in (("time_delay", None), ("current_lag", 2)):
        assert EFFECTS[name].likely(now, joint, (1e-3,), np.array([-3e-3])) == ((-3e-3,),)
        assert EFFECTS[name].likely(now, joint, (1e-3,), np.array([0.04])) == ((0.02,),)


@pytest.mark.slow
def test_a_gear_of_known_compliance_has_a_resonance(now, seen, twin):
    """A link on a gear of compliance c has the stiffness 1 / c; those of a scan are of its inertia, by pinocchio.

    Of a rotor that the robot's description does not know half of that may be.
    """
    elastic, robot = EFFECTS["joint_elasticity"], now.robot
    bare = seen(5, robot=replace(robot, rotor_inertia=np.zeros(5)))
    for joint in (1, 3, 5):
        faster = now.ddq + np.eye(5)[joint - 1]
        more, less = (twin(now.robot).torque(now.q, now.dq, ddq, now.robot.inertia) for ddq in (faster, now.ddq))
        inertia = (more - less)[:, joint - 1]
        scanned = elastic.grid(bare, joint)
        count = len(scanned) // 2
        assert elastic.grid(now, joint) == pytest.approx(np.array(scanned[:count]))
        frequencies = np.array([3.5, 4.2, 5.0, 6.0, 7.2, 8.6, 10.4, 12.5, 15.0, 18.0, 30.0, 300.0])
        # Below what a motion has its resonance is narrow, by 5 % of damping: a scan must not step over it.
        assert (frequencies[1:10] / frequencies[:9]).max() < 1.22
        resonances = (2 * np.pi * frequencies) ** 2
        half = 0.5 * inertia.min()
        wanted = [*(inertia.mean() * resonances), *((inertia.mean() - half) * resonances)]
        np.testing.assert_allclose([stiffness for stiffness, *_ in scanned], wanted, rtol=0.01)
        np.testing.assert_allclose([rotor for _, rotor, _ in scanned], [0.0] * count + [half] * count, rtol=0.01)
        stiff = pytest.approx(wanted[2], rel=0.01)
        likely = elastic.likely(bare, joint, (1.0, 0.0, 0.1), np.array([1 / wanted[2]]))
        every = {
            (s, rotor, damping) for s in (stiff.expected, None) for rotor in (0.0, None) for damping in (0.05, None)
        }
        assert len(likely) == len(every) - 1
        assert likely[0] == (stiff, 0.0, 0.05)
        assert (None, None, None) not in likely
        plain = elastic.likely(now, joint, (1.0, 0.0, 0.1), np.array([1 / wanted[2]]))
        assert plain == ((stiff, 0.0, 0.05), (stiff, 0.0, None), (None, 0.0, 0.05))
        softest = elastic.bounds(now, joint)[0][0]
        assert elastic.likely(now, joint, (1.0, 0.0, 0.1), np.array([1e9]))[0] == (softest, 0.0, 0.05)
    assert elastic.likely(now, 1, (60.0, 0.0, 0.1), np.zeros(1)) == ((None, 0.0, 0.05),)


@pytest.mark.parametrize(("name", "joint"), [("time_delay", None), ("current_lag", 1)])
def test_a_delay_of_less_than_friction_tells_is_none(random_robot, name, joint):
    """A fiftieth of a sample is how a sign is drawn between two rows; .5 ms is a delay, 50 ms no drive's."""
    robot = random_robot(2, 3)
    believed = [EFFECTS[name].is_plausible(robot, joint, np.array([delay])) for delay in (8e-5, 5e-4, 0.05)]
    assert believed == [False, True, False]


@pytest.mark.parametrize(("name", "joint"), [("time_delay", None), ("current_lag", 1)])
def test_a_delay_that_reversals_and_all_else_tell_otherwise_is_none(random_robot, name, joint):
    """A filter may be a little other for a step than for a ramp; one that stops where it must is two things."""
    robot, effect, shape = random_robot(2, 3), EFFECTS[name], (0.01,)
    low, high = effect.ranges(robot, joint, shape)[0]
    believed = [effect.is_plausible(robot, joint, np.array([lag]), shape) for lag in (low, 0.008, 0.01, 0.013, high)]
    assert believed == [False, True, True, True, False]
