"""Pushes, lasting contacts and guiding hands, against pinocchio's torque of them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.signal import lfilter

from robots.terms.effects import EFFECTS

# Of sin(pi s)^.1 over s from 0 to 1.
MEAN = float(quad(lambda s: np.sin(np.pi * s) ** 0.1, 0.0, 1.0)[0])


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
    flat = X.reshape(-1, X.shape[2])
    left = torque.reshape(-1) - flat @ np.linalg.lstsq(flat, torque.reshape(-1), rcond=None)[0]
    # The pulse lies between a half sine and a hold: 2 % of a half sine's energy, and what the pose changes.
    assert np.sum(left**2) < 0.1 * np.sum(torque**2)


def test_a_push_on_a_further_joint_alone_is_none(catalogue_robot) -> None:
    """A force that only joint 4 feels would miss three axes; across the arm one may well miss all but the first."""
    push, brief, lasting = EFFECTS["external_contact"], (3.0, 0.4, 0.6, 0.0), (3.0, 0.4, 0.6, 1.0)
    robot = catalogue_robot("er3a")
    each = np.eye(12)
    alone = each[3] * 5.0 + 0.04 * each[: robot.n].sum(axis=0)
    assert not push.is_plausible(robot, None, alone, brief)
    assert push.is_plausible(robot, None, alone + 0.4 * each[1], brief)
    assert push.is_plausible(robot, None, each[0] * 5.0, brief)
    assert push.is_plausible(robot, None, each[1] * 5.0, brief)
    assert push.is_plausible(robot, None, alone, lasting)


def test_a_push_that_lasts_is_a_wrench_on_the_flange(now, twin):
    """A force and a moment that stay the same in the base frame, by pinocchio, whatever the arm does meanwhile."""
    pin = pytest.importorskip("pinocchio")
    push = EFFECTS["external_contact"]
    model = twin(now.robot).model
    data = model.createData()
    wrench, more = np.array([30.0, -10.0, 20.0, 2.0, -1.0, 3.0]), np.zeros(6)
    X = push.columns(now, None, (1.0, 1.5, 0.1, 1.0))
    during = np.flatnonzero((now.t > 1.1) & (now.t < 2.4))[::20]
    strength = np.sin(np.pi * (now.t[during] - 1.0) / 1.5) ** 0.1 / MEAN
    flange = now.sensitivity("flange")[during][:, :, 0]
    for i, p, place in zip(during, strength, flange, strict=True):
        # Of the frame in the base's directions whose origin is the flange's.
        pin.computeJointJacobians(model, data, now.q[i])
        own = pin.getJointJacobian(model, data, model.njoints - 1, pin.LOCAL_WORLD_ALIGNED)
        lever = place - data.oMi[model.njoints - 1].translation
        moment = wrench[3:] + np.cross(lever, wrench[:3])
        np.testing.assert_allclose(X[i] @ [*wrench, *more], p * own.T @ np.concatenate([wrench[:3], moment]), atol=1e-6)
    assert [c.name for c in push.described(now.robot, None, (1.0, 1.5, 0.1, 1.0))][:3] == [
        "mean_force_x",
        "mean_force_y",
        "mean_force_z",
    ]
    assert "force of 37.4 N" in push.describe(None, wrench, (1.0, 1.5, 0.1, 1.0))


@pytest.mark.parametrize("hardness", [0.005, 0.1, 0.6, 1.0, 2.0])
def test_a_force_that_lasts_is_reported_by_its_mean(now, hardness):
    """Whatever its course: a column's impulse over the duration is that of one newton."""
    column = EFFECTS["external_contact"].columns(now, None, (1.0, 1.5, hardness, 1.0))[:, :, 0]
    jacobian = now.sensitivity("jacobian")[:, 0]
    joint = int(np.argmax(np.abs(jacobian).mean(axis=0)))
    during = (now.t > 1.0) & (now.t < 2.5) & (np.abs(jacobian[:, joint]) > 1e-3)
    course = column[during, joint] / jacobian[during, joint]
    assert np.trapezoid(course, now.t[during]) / 1.5 == pytest.approx(1.0, abs=0.02)


def test_a_push_on_a_body_is_a_force_at_one_place_of_it(now, twin):
    """By pinocchio: the Jacobian of a place of that body, whatever the arm does meanwhile."""
    body = (now.robot.n + 1) // 2
    pin = pytest.importorskip("pinocchio")
    push = EFFECTS["external_contact"]
    model = twin(now.robot).model
    data = model.createData()
    force, place = np.array([30.0, -10.0, 20.0]), np.array([0.1, -0.2, 0.3])
    X = push.columns(now, None, (1.0, 1.5, 0.1, 0.0, float(body)))
    assert not X[now.t > 2.5].any()
    coefficients = np.concatenate([force, np.outer(place, force).ravel()])
    during = np.flatnonzero((now.t > 1.1) & (now.t < 2.4))[::20]
    for i in during:
        pin.computeJointJacobians(model, data, now.q[i])
        own = pin.getJointJacobian(model, data, body, pin.LOCAL_WORLD_ALIGNED)
        lever = data.oMi[body].rotation @ place
        wrench = np.concatenate([force, np.cross(lever, force)])
        strength = np.sin(np.pi * (now.t[i] - 1.0) / 1.5) ** 0.1 / MEAN
        np.testing.assert_allclose(X[i] @ coefficients, strength * own.T @ wrench, atol=1e-6)
    reported = push.describe(None, coefficients, (1.0, 1.5, 0.1, 0.0, float(body)))
    assert f"force of 37.4 N at one place of body {body}" in reported


def test_a_push_that_lasts_is_looked_for_about_a_brief_one(now):
    """From the part in which the arm moves least the whole is found: so long before, about and after it."""
    (points,) = EFFECTS["external_contact"].other_optima(now, None, (2.0, 0.3, 0.6, 0.0, 0.0), np.zeros(12))
    assert all(0.0 <= start <= now.t[-1] and flange == 1.0 for start, _, _, flange, _ in points)
    spans = {(round(start, 3), round(start + duration, 3)) for start, duration, *_ in points}
    assert {(2.0, 2.3), (2.0, 3.2), (1.1, 2.3), (1.55, 2.75)} <= spans


def test_a_search_for_pushes_finds_the_moment(now):
    """Ranked by what a constant explains, the windows of a push come first, in noise twice its size.

    Slow noise makes more of a long window than of a short one; joints that rest for most of the time are
    judged by the rest of it, and one that stands by nothing.
    """
    rng = np.random.default_rng(1)
    X = EFFECTS["external_contact"].columns(now, None, (3.1, 0.8))
    torque = X @ np.array([20.0, 30.0, -10.0, 5.0, 5.0, 0.0, *np.zeros(6)])
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


def test_a_push_is_reported_by_what_joints_feel_of_it() -> None:
    """A force that is rounding beside the moment is none, and so is a moment beside a force."""
    shape = (21.3, 1.5, 0.1, 1.0)
    for reported, size in (
        ("a moment of 1.26 N m", [1e-9, 0.0, 2e-10, 0.0, 1.26, 0.0]),
        ("a force of 5 N", [3.0, 4.0, 0, 0, 0, 0]),
    ):
        sentence = EFFECTS["external_contact"].describe(None, np.array(size), shape)
        assert f"with {reported}, constant" in sentence
    both = EFFECTS["external_contact"].describe(None, np.array([3.0, 4.0, 0.0, 0.0, 2.0, 0.0]), shape)
    assert "with a force of 5 N and a moment of 2 N m" in both
