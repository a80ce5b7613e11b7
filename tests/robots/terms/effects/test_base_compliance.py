"""Tests of a compliant base that tilts under the robot's weight and accelerations, against pinocchio."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from robots import load_robot
from robots.regressor import TorqueModel, default_model
from robots.robot import Robot
from robots.terms.effects import EFFECTS, Situation, situation
from robots.terms.effects.base_compliance import BaseCompliance

STIFF = (1e12, 1e12, 0.0, 0.05)


@pytest.fixture(scope="module")
def robot() -> Robot:
    """Returns a heavy arm of six joints with a vertical first axis."""
    return load_robot("ur10")


@pytest.fixture(scope="module")
def state(robot: Robot) -> Situation:
    """Returns a hundred poses with other link masses than described."""
    rng = np.random.default_rng(3)
    model = default_model(robot)
    values = np.zeros(model.size)
    values[_rigid(model)] = _bodies(robot.n).ravel()
    q = rng.uniform(-2, 2, (100, robot.n))
    # Poses far apart in time: the base follows them without acceleration.
    return situation(model, values, 1e6 * np.arange(100), q, np.zeros_like(q), np.zeros_like(q))


def _rigid(model: TorqueModel) -> list[int]:
    return [i for i, column in enumerate(model.columns) if column.term == "rigid_body"]


def _bodies(n: int) -> np.ndarray:
    """Draws mass, first moment and inertia of each link about its frame (n, 10)."""
    rng = np.random.default_rng(4)
    bodies = []
    for _ in range(n):
        mass, lever = rng.uniform(1, 9), rng.uniform(-0.2, 0.2, 3)
        inertia = np.eye(3) * rng.uniform(0.1, 0.3) + mass * (lever @ lever * np.eye(3) - np.outer(lever, lever))
        xx, xy, xz, yy, yz, zz = inertia[np.triu_indices(3)]
        bodies.append([mass, *(mass * lever), xx, xy, xz, yy, yz, zz])
    return np.array(bodies)


def _model(robot: Robot) -> pin.Model:
    model, parent = pin.Model(), 0
    for joint, body in zip(robot.chain.joints, _bodies(robot.n), strict=True):
        placement = pin.SE3(np.asarray(joint.rotation), np.asarray(joint.translation))
        parent = model.addJoint(parent, pin.JointModelRevoluteUnaligned(np.asarray(joint.axis)), placement, joint.name)
        # pinocchio orders the inertia as xx, xy, yy, xz, yz, zz.
        inertia = pin.Inertia.FromDynamicParameters(body[[0, 1, 2, 3, 4, 5, 7, 6, 8, 9]])
        model.appendBodyToJoint(parent, inertia, pin.SE3.Identity())
    return model


def test_the_columns_are_gravity_on_a_base_that_its_weight_has_turned(robot: Robot, state: Situation) -> None:
    """With an anisotropic compliance C, the columns give the torque difference by a base rotated by C m.

    The rotations are finite, 2e-4 rad at most, so the error of linearisation is a few millionths of a newton metre.
    """
    model = _model(robot)
    data = model.createData()
    compliance = 1e-7 * np.array([[4.0, 1.0], [1.0, 9.0]])
    expected = np.empty_like(state.q)
    for k, q in enumerate(state.q):
        weight = sum(inertia.mass for inertia in model.inertias) * np.array([0, 0, -9.81])
        moment = np.cross(pin.centerOfMass(model, data, q), weight)[:2]
        # In the frame of the rotated base, gravity rotates in the opposite direction.
        turned = Rotation.from_rotvec([*(compliance @ moment), 0.0]).inv().apply([0, 0, -9.81])
        level = pin.computeGeneralizedGravity(model, data, q).copy()
        model.gravity.linear = turned
        expected[k] = pin.computeGeneralizedGravity(model, data, q) - level
        model.gravity.linear = np.array([0, 0, -9.81])
    X = BaseCompliance().columns(state, None, STIFF)
    found = X @ np.array([4e-7, 9e-7, 1e-7, 0.0, 0.0])
    assert X.shape == (100, 6, 5)
    assert np.abs(expected).max() > 1e-3
    assert found == pytest.approx(expected, abs=2e-3 * np.abs(expected).max())


def test_what_the_first_link_adds_goes_round_with_it(robot: Robot, state: Situation) -> None:
    """The first moments of the first link are covered by the two columns that rotate with it."""
    whole = BaseCompliance().columns(state, None, STIFF)
    values = state.parameters.copy()
    values[_rigid(state.model)[:10]] = 0.0
    without = situation(state.model, values, state.t, state.q, state.dq, state.ddq)
    poorer = BaseCompliance().columns(without, None, STIFF)
    # With equal compliances, and without the first joint, on which a tilted base acts, too.
    lost = (whole - poorer)[:, 1:, :2].sum(axis=2).ravel()
    own = poorer[:, 1:, 3:].reshape(-1, 2)
    rest = lost - own @ np.linalg.lstsq(own, lost, rcond=None)[0]
    assert np.abs(lost).max() > 1.0
    assert np.abs(rest).max() < 1e-9 * np.abs(lost).max()


def _on_base(robot: Robot) -> pin.Model:
    """Builds the arm with two joints under it, about the base's x and y axes."""
    arm = _model(robot)
    model, parent = pin.Model(), 0
    for name, axis in (("x", np.eye(3)[0]), ("y", np.eye(3)[1])):
        parent = model.addJoint(parent, pin.JointModelRevoluteUnaligned(axis), pin.SE3.Identity(), name)
    for joint, placement, inertia in zip(robot.chain.joints, arm.jointPlacements[1:], arm.inertias[1:], strict=True):
        axis = np.asarray(joint.axis)
        parent = model.addJoint(parent, pin.JointModelRevoluteUnaligned(axis), placement, joint.name)
        model.appendBodyToJoint(parent, inertia, pin.SE3.Identity())
    return model


def _motion(robot: Robot, t: np.ndarray, jerky: bool = False) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Moves all joints at about 1 Hz after a start from rest in half a second; positions and two derivatives.

    Where it is jerky, friction makes the acceleration jump at each reversal, and a loop undoes that in 50 ms.
    """
    w = 2 * np.pi * np.linspace(0.7, 1.3, robot.n)
    rise = t**4 / (t**4 + 0.5**4)
    q = 0.6 * rise[:, None] * np.sin(np.outer(t, w) + np.arange(robot.n))
    if jerky:
        v = CubicSpline(t, q)(t, 1)
        for j, velocity in enumerate(v.T):
            for k in np.flatnonzero(velocity[1:] * velocity[:-1] < 0):
                since = np.maximum(t - t[k], 0.0)
                q[:, j] += 2.0 * np.sign(velocity[k]) * since**2 * np.exp(-since / 0.015)
    spline = CubicSpline(t, q)
    return q, spline(t, 1), spline(t, 2)


def _on_springs(robot: Robot, t: np.ndarray, motion: tuple[np.ndarray, ...], stiffness: np.ndarray, lost: np.ndarray):
    """Integrates by scipy an arm with prescribed joints on a base with two springs, with pinocchio's dynamics.

    Returns:
        Tilts and their rates (4, N), accelerations (N, 2), and the torque of the joints beyond a rigid base (N, n).
    """
    model, n = _on_base(robot), robot.n
    data, (q, dq, ddq) = model.createData(), motion
    courses = CubicSpline(t, np.hstack(motion))

    def change(time: float, state: np.ndarray) -> np.ndarray:
        lean, rate = state[:2], state[2:]
        at, speed, rise = np.split(courses(time), 3)
        whole = np.concatenate([lean, at])
        pin.crba(model, data, whole)
        rest = pin.rnea(model, data, whole, np.concatenate([rate, speed]), np.concatenate([[0.0, 0.0], rise]))
        curve = np.linalg.solve(data.M[:2, :2], -rest[:2] - stiffness * lean - lost * rate)
        return np.concatenate([rate, curve])

    begin = np.zeros(4)
    begin[:2] = -pin.rnea(model, data, np.concatenate([[0, 0], q[0]]), np.zeros(n + 2), np.zeros(n + 2))[:2] / stiffness
    course = solve_ivp(change, (0.0, t[-1]), begin, t_eval=t, rtol=1e-6, atol=1e-9, max_step=5e-3).y
    curve = np.array([change(time, state)[2:] for time, state in zip(t, course.T, strict=True)])
    torque = np.empty_like(q)
    for k in range(len(t)):
        moved = [np.concatenate([own, arm]) for own, arm in ((course[:2, k], q[k]), (course[2:, k], dq[k]))]
        with_base = pin.rnea(model, data, *moved, np.concatenate([curve[k], ddq[k]]))
        still = pin.rnea(model, data, *(np.concatenate([[0, 0], arm[k]]) for arm in (q, dq, ddq)))
        torque[k] = (with_base - still)[2:]
    return course, curve, torque


@pytest.mark.parametrize(
    ("stiffness", "lost", "jerky", "first", "error"),
    [
        ((6e4, 2e5), (150.0, 300.0), False, 0, 0.02),
        ((6e3, 9e3), (60.0, 80.0), True, 0, 0.2),
        ((6e4, 9e4), (150.0, 200.0), False, 500, 0.1),
    ],
)
def test_the_columns_are_an_arm_on_springs_that_scipy_integrates(
    stiffness: tuple[float, float], lost: tuple[float, float], jerky: bool, first: int, error: float, robot: Robot
) -> None:
    """Bases that oscillate at 1.6 to 8 Hz; friction makes one motion jerky, and one log begins in the middle."""
    t = 4e-3 * np.arange(1000)
    motion = _motion(robot, t, jerky)
    course, curve, torque = _on_springs(robot, t, motion, np.array(stiffness), np.array(lost))
    expected, whole = torque[first:], [values[first:] for values in motion]
    own = default_model(robot)
    values = np.zeros(own.size)
    values[_rigid(own)] = _bodies(robot.n).ravel()
    state = situation(own, values, t[first:], *whole)
    inertia = np.einsum("nii->ni", state.sensitivity("base_inertia"))[:, :2].mean(axis=0)
    damping = float(np.mean(lost / (2 * np.sqrt(stiffness * inertia))))
    columns = BaseCompliance().columns(state, None, (*stiffness, 0.0, damping))
    found = columns @ [*(1 / np.array(stiffness)), 0.0, 0.0, 0.0]
    assert np.abs(curve).max() > 20.0 * np.abs(course[:2]).max()  # it oscillates
    away = (found - expected)[20:-20]
    # The sag by gravity is part of the stiffness, and tilts of 5 degrees are not small to second order.
    assert np.std(away) < error * np.std(expected)


def test_values_are_described_and_checked(robot: Robot) -> None:
    """The effect is found by its name, has compliances per axis, and describes the largest of them."""
    effect = EFFECTS["base_compliance"]
    units = [(c.name, c.unit) for c in effect.parameters(robot, None)]
    assert units[0] == ("compliance_1", "rad/(N m)")
    assert units[-1] == ("own_2", "rad")
    assert "0.29 deg under 1000 N m" in effect.describe(None, np.array([5e-6, 1e-6, 0.0, 0.3, 0.2]))
    assert effect.is_plausible(robot, None, np.array([5e-6, 1e-6, 1e-6, 0.1, 0.1]))
    # A base that gives energy.
    assert not effect.is_plausible(robot, None, np.array([5e-6, 1e-6, 4e-6, 0.1, 0.1]))
