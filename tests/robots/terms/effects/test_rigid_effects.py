"""Effects through the rigid body, against pinocchio's torque of the changed robot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

from robots.geometry.chain import Chain
from robots.robot import Robot
from robots.terms.effects import EFFECTS
from robots.terms.effects.backlash import SLOWEST
from robots.terms.effects.base_tilt import level_axes
from robots.terms.effects.joint_elasticity import followed

STEP = 1e-5
SOME = slice(100, 1400, 65)


@pytest.fixture(params=[1, 3, 6])
def now(request, seen):
    return seen(5, seed=request.param)


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


def test_an_elastic_gear_lets_its_link_lag(now, torque):
    """A stiff gear changes all torques as a link does that lags by its load, with its velocity and acceleration."""
    for joint in (1, 3, 5):
        spline = CubicSpline(now.t, now.load[:, joint - 1])
        step = -np.eye(5)[joint - 1]
        change = [spline(now.t[SOME], order)[:, None] * step for order in range(3)]
        # Large lags (c = 1) would leave the difference's range: it is scaled to the largest.
        size = max(float(np.abs(part).max()) for part in change)
        expected = _slope(torque, now, [part / size for part in change]) * size
        X = EFFECTS["joint_elasticity"].columns(now, joint, (1e9, 0.0))[SOME, :, 0]
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
    assert [tilt.leaves(upright, j) for j in range(3)] == [0.5, 0.08, 0.08]
    assert tilt.leaves(upright, 0, (1.0,)) == 0.08  # its own moments are told
    assert tilt.leaves(lying, 0) == EFFECTS["spring"].leaves(upright, 0) == 0.08


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


def test_level_axes_are_x_and_y_of_an_upright_robot():
    """Where gravity is along z, the tilts are about x and y."""
    np.testing.assert_array_equal(level_axes(np.array([0.0, 0.0, -9.81])), [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def test_a_payload_is_a_body_on_the_flange(now, twin, catalogue_robot, seen):
    """A body's mass, moments and inertia change the torques as a heavier link does; its products are left out."""
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
        np.testing.assert_array_equal(
            X, np.where(seen_by.t[:, None, None] >= 3.0, tool[:, :, [0, 1, 2, 3, 4, 7, 9]], 0.0)
        )


def test_a_push_anywhere_is_felt_by_each_joint(now, twin):
    """A force on the flange during a push of a third of a second is a pulse on each joint, to some per cent."""
    pin = pytest.importorskip("pinocchio")
    model = twin(now.robot).model
    data = model.createData()
    shape = (2.0, 0.3)
    during = np.flatnonzero((now.t > 2.0) & (now.t < 2.3))
    torque = np.zeros_like(now.q)
    for i in during:
        jacobian = pin.computeJointJacobian(model, data, now.q[i], 5)
        wrench = np.array([30.0, -10.0, 20.0, 0.0, 0.0, 0.0]) * np.sin(np.pi * (now.t[i] - 2.0) / 0.3)
        torque[i] = jacobian.T @ wrench
    X = EFFECTS["external_contact"].columns(now, None, shape)
    assert not X[now.t >= 2.3].any()
    flat = X.reshape(-1, 6)
    left = torque.reshape(-1) - flat @ np.linalg.lstsq(flat, torque.reshape(-1), rcond=None)[0]
    # The pulse lies between a half sine and a hold: 2 % of a half sine's energy, and what the pose changes.
    assert np.sum(left**2) < 0.1 * np.sum(torque**2)


def test_a_push_on_a_further_joint_alone_is_none(catalogue_robot) -> None:
    """A force that only joint 4 feels would miss three axes; across the arm one may well miss all but the first."""
    push, brief, lasting = EFFECTS["external_contact"], (3.0, 0.4, 0.6, 0.0), (3.0, 0.4, 0.6, 1.0)
    robot = catalogue_robot("er3a")
    n = robot.n
    alone = np.eye(n)[3] * 5.0 + 0.04
    assert not push.believable(robot, None, alone, brief)
    assert push.believable(robot, None, alone + 0.4 * np.eye(n)[1], brief)
    assert push.believable(robot, None, np.eye(n)[0] * 5.0, brief)
    assert push.believable(robot, None, np.eye(n)[1] * 5.0, brief)
    assert push.believable(robot, None, alone, lasting)


def test_a_push_that_lasts_is_a_wrench_on_the_flange(now, twin):
    """A force and a moment that stay the same in the base frame, by pinocchio, whatever the arm does meanwhile."""
    pin = pytest.importorskip("pinocchio")
    push = EFFECTS["external_contact"]
    model = twin(now.robot).model
    data = model.createData()
    wrench = np.array([30.0, -10.0, 20.0, 2.0, -1.0, 3.0])
    X = push.columns(now, None, (1.0, 1.5, 0.1, 1.0))
    during = np.flatnonzero((now.t > 1.1) & (now.t < 2.4))[::20]
    strength = np.sin(np.pi * (now.t[during] - 1.0) / 1.5) ** 0.1
    flange = now.sensitivity("flange")[during][:, :, 0]
    for i, p, place in zip(during, strength, flange, strict=True):
        # Of the frame in the base's directions whose origin is the flange's.
        pin.computeJointJacobians(model, data, now.q[i])
        own = pin.getJointJacobian(model, data, model.njoints - 1, pin.LOCAL_WORLD_ALIGNED)
        lever = place - data.oMi[model.njoints - 1].translation
        moment = wrench[3:] + np.cross(lever, wrench[:3])
        np.testing.assert_allclose(X[i] @ wrench, p * own.T @ np.concatenate([wrench[:3], moment]), atol=1e-6)
    assert [c.name for c in push.described(now.robot, None, (1.0, 1.5, 0.1, 1.0))][:3] == [
        "force_x",
        "force_y",
        "force_z",
    ]
    assert "force of 37.4 N" in push.describe(None, wrench, (1.0, 1.5, 0.1, 1.0))


def test_a_push_that_lasts_is_looked_for_about_a_brief_one(now):
    """From the part in which the arm moves least the whole is found: so long before, about and after it."""
    (points,) = EFFECTS["external_contact"].elsewhere(now, None, (2.0, 0.3, 0.6, 0.0), np.zeros(6))
    assert all(0.0 <= start <= now.t[-1] and flange == 1.0 for start, _, _, flange in points)
    spans = {(round(start, 3), round(start + duration, 3)) for start, duration, *_ in points}
    assert {(2.0, 2.3), (2.0, 3.2), (1.1, 2.3), (1.55, 2.75)} <= spans


def test_a_search_for_pushes_finds_the_moment(now):
    """Ranked by what a constant explains, the windows of a push come first, in noise twice its size.

    Slow noise makes more of a long window than of a short one; joints that rest for most of the time are told by the
    rest of it, and one that stands by nothing.
    """
    rng = np.random.default_rng(1)
    X = EFFECTS["external_contact"].columns(now, None, (3.1, 0.8))
    torque = X @ np.array([20.0, 30.0, -10.0, 5.0, 5.0, 0.0])
    size = np.sqrt(np.mean(torque**2, axis=0))
    slow = lfilter([0.01], [1, -0.99], rng.normal(size=torque.shape), axis=0)
    for noise in (2 * rng.normal(size=torque.shape), slow):
        left = torque + size * noise
        left[now.t < 2.5] = 0.0
        left[:, 3] = 0.0
        start, duration, *_ = EFFECTS["external_contact"].propose(now, None, left, 3)[0]
        assert abs(start + duration / 2 - 3.5) < 0.4


def test_a_hand_takes_what_motion_needs(seen, twin):
    """A hand that guides the robot leaves the drives gravity, by pinocchio, but for a share, and offsets."""
    t = np.concatenate([0.004 * np.arange(700), 60 + 0.004 * np.arange(800)])
    now = seen(times=t, starts=(0, 700))
    guiding = EFFECTS["hand_guiding"]
    window = next(point for point in guiding.grid(now, None) if point[0] > 50)
    X = guiding.columns(now, None, window)
    assert not X[:700].any()
    f1, f2 = np.array(now.robot.friction)[:, :2].T
    share = 0.1 * np.arange(1, now.robot.n + 1)
    taken = X @ np.column_stack([-f1, -f2, np.ones(now.robot.n), share]).reshape(-1)
    state, rest = (now.q[700:], now.dq[700:]), np.zeros_like(now.q[700:])
    moving = twin(now.robot).torque(*state, now.ddq[700:], now.robot.inertia)
    weight = twin(now.robot).torque(now.q[700:], rest, rest, now.robot.inertia)
    moving -= weight
    moving += np.array(now.robot.rotor_inertia) * now.ddq[700:]
    expected = -moving - share * weight - f1 * np.sign(now.dq[700:]) - f2 * now.dq[700:]
    np.testing.assert_allclose(taken[700:], expected, atol=1e-9 * np.abs(now.rigid).max())


def test_a_hand_on_all_of_the_only_log_shows_nowhere(seen):
    """Where there is one log, a hand on all of it is what the model was fitted to: windows within it are tried."""
    now = seen()
    windows = EFFECTS["hand_guiding"].grid(now, None)
    duration = now.t[-1] - now.t[0]
    assert windows
    assert all(now.t[0] <= start < end <= now.t[-1] + 1e-9 for start, end in windows)
    assert max(end - start for start, end in windows) < 0.6 * duration


def test_the_window_with_most_left_in_it_is_proposed(seen):
    """A residual that is five times as large for a fifth of the log, on all joints."""
    now = seen(times=0.02 * np.arange(3000))
    rng = np.random.default_rng(3)
    during = (now.t > 21.0) & (now.t < 33.0)
    left = rng.normal(size=now.q.shape) * np.where(during, 5.0, 1.0)[:, None]
    guiding = EFFECTS["hand_guiding"]
    proposed = guiding.propose(now, None, left, 6)
    assert len(guiding.grid(now, None)) > 60 > len(proposed)
    start, end = proposed[0]
    assert min(end, 33.0) - max(start, 21.0) > 0.5 * (max(end, 33.0) - min(start, 21.0))


def test_an_axis_along_gravity_carries_no_weight(seen):
    """What rounding leaves of it is no column: a share of it would be any number."""
    now = seen(times=0.02 * np.arange(1000))
    X = EFFECTS["hand_guiding"].columns(now, None, (now.t[0], now.t[-1]))
    weight = np.einsum("njk,nk->nj", now.sensitivity("gravity"), now.gravity)
    for j in range(now.robot.n):
        assert X[:, j, 4 * j + 3].any() == (np.abs(weight[:, j]).max() > 1e-6)


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


def test_size_of_an_effect_tells_its_time(seen):
    """What follows from a coefficient is offered: the gap that is crossed, a delay's own reversals, a resonance."""
    now = seen(5, seed=1)
    bare = seen(5, seed=1, robot=replace(now.robot, rotor_inertia=np.zeros(5)))
    for known, at, count in ((True, now, 7), (False, bare, 15)):
        crossings = EFFECTS["backlash"].likely(at, 2, (1e-3, 0.07, 0.2, 0.0), np.array([2e-4]))
        assert crossings[0] == (4e-4, SLOWEST, 0.0, 0.0)
        assert len(set(crossings)) == count
        assert (None,) * 4 not in crossings
        assert ((None, None, None, 0.0) in crossings) is not known
    for name, joint in (("time_delay", None), ("current_lag", 2)):
        assert EFFECTS[name].likely(now, joint, (1e-3,), np.array([-3e-3])) == ((-3e-3,),)
        assert EFFECTS[name].likely(now, joint, (1e-3,), np.array([0.04])) == ((0.02,),)


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
        np.testing.assert_allclose([stiffness for stiffness, _ in scanned], wanted, rtol=0.01)
        np.testing.assert_allclose([rotor for _, rotor in scanned], [0.0] * count + [half] * count, rtol=0.01)
        stiff = pytest.approx(wanted[2], rel=0.01)
        likely = elastic.likely(bare, joint, (1.0, 0.0), np.array([1 / wanted[2]]))
        assert likely == ((stiff, 0.0), (None, 0.0), (stiff, None))
        assert elastic.likely(now, joint, (1.0, 0.0), np.array([1 / wanted[2]])) == ((stiff, 0.0),)
        assert elastic.likely(now, joint, (1.0, 0.0), np.array([1e9]))[0] == (elastic.bounds(now, joint)[0][0], 0.0)
    assert elastic.likely(now, 1, (60.0, 0.0), np.zeros(1)) == ()


@pytest.mark.parametrize(("name", "joint"), [("time_delay", None), ("current_lag", 1)])
def test_a_delay_of_less_than_friction_tells_is_none(random_robot, name, joint):
    """A fiftieth of a sample is how a sign is drawn between two rows; .5 ms is a delay, 50 ms no drive's."""
    robot = random_robot(2, 3)
    believed = [EFFECTS[name].believable(robot, joint, np.array([delay])) for delay in (8e-5, 5e-4, 0.05)]
    assert believed == [False, True, False]


@pytest.mark.parametrize(("name", "joint"), [("time_delay", None), ("current_lag", 1)])
def test_a_delay_that_reversals_and_all_else_tell_otherwise_is_none(random_robot, name, joint):
    """A filter may be a little other for a step than for a ramp; one that stops where it must is two things."""
    robot, effect, shape = random_robot(2, 3), EFFECTS[name], (0.01,)
    low, high = effect.ranges(robot, joint, shape)[0]
    believed = [effect.believable(robot, joint, np.array([lag]), shape) for lag in (low, 0.008, 0.01, 0.013, high)]
    assert believed == [False, True, True, True, False]
