"""Tests of a compliant base that tilts under the robot's weight, against pinocchio."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from estimation.models.extension import find_effect
from robots import load_robot
from robots.regressor import TorqueModel, default_model
from robots.robot import Robot
from robots.terms.discrepancies.base_compliance import BaseCompliance
from robots.terms.effects import Situation, situation


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
    return situation(model, values, 0.1 * np.arange(100), q, np.zeros_like(q), np.zeros_like(q))


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
    X = BaseCompliance().columns(state, None)
    found = X @ np.array([4e-7, 9e-7, 1e-7, 0.0, 0.0])
    assert X.shape == (100, 6, 5)
    assert np.abs(expected).max() > 1e-3
    assert found == pytest.approx(expected, abs=2e-3 * np.abs(expected).max())


def test_what_the_first_link_adds_goes_round_with_it(robot: Robot, state: Situation) -> None:
    """The first moments of the first link are covered by the two columns that rotate with it."""
    whole = BaseCompliance().columns(state, None)
    values = state.parameters.copy()
    values[_rigid(state.model)[:10]] = 0.0
    without = situation(state.model, values, state.t, state.q, state.dq, state.ddq)
    poorer = BaseCompliance().columns(without, None)
    # With equal compliances, and without the first joint, on which a tilted base acts, too.
    lost = (whole - poorer)[:, 1:, :2].sum(axis=2).ravel()
    own = poorer[:, 1:, 3:].reshape(-1, 2)
    rest = lost - own @ np.linalg.lstsq(own, lost, rcond=None)[0]
    assert np.abs(lost).max() > 1.0
    assert np.abs(rest).max() < 1e-9 * np.abs(lost).max()


def test_it_is_told_in_words_and_read_from_its_name(robot: Robot) -> None:
    """The effect is found by its name, has compliances per axis, and describes the largest of them."""
    effect = find_effect("pattern:leaning:0:even")
    assert isinstance(effect, BaseCompliance)
    units = [(c.name, c.unit) for c in effect.parameters(robot, None)]
    assert units[0] == ("compliance_1", "rad/(N m)")
    assert units[-1] == ("own_2", "rad")
    assert "0.29 deg per 1000 N m" in effect.describe(None, np.array([5e-6, 1e-6, 0.0, 0.3, 0.2]))
    # A base cannot tilt against its load.
    assert "under the robot's weight" not in effect.describe(None, np.array([-5e-6, 1e-6, 0.0, 0.3, 0.2]))
