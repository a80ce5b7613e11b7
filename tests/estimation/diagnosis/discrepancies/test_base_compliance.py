"""Specification of a base that leans under the robot's weight, by pinocchio's gravity and centre of mass."""

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
    """A heavy arm of six joints on an upright axis."""
    return load_robot("ur10")


@pytest.fixture(scope="module")
def state(robot: Robot) -> Situation:
    """A hundred poses, with masses of our own for all links."""
    rng = np.random.default_rng(3)
    model = default_model(robot)
    values = np.zeros(model.size)
    values[_rigid(model)] = _bodies(robot.n).ravel()
    q = rng.uniform(-2, 2, (100, robot.n))
    return situation(model, values, 0.1 * np.arange(100), q, np.zeros_like(q), np.zeros_like(q))


def _rigid(model: TorqueModel) -> list[int]:
    return [i for i, column in enumerate(model.columns) if column.term == "rigid_body"]


def _bodies(n: int) -> np.ndarray:
    """Mass, first moment and inertia of each link about its frame (n, 10)."""
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
        # pinocchio counts xx, xy, yy, xz, yz, zz.
        inertia = pin.Inertia.FromDynamicParameters(body[[0, 1, 2, 3, 4, 5, 7, 6, 8, 9]])
        model.appendBodyToJoint(parent, inertia, pin.SE3.Identity())
    return model


def test_the_columns_are_gravity_on_a_base_that_its_weight_has_turned(robot: Robot, state: Situation) -> None:
    """Bolts softer about y than about x and askew: the torque of a base turned by C m, less that of one that is not.

    The turns are finite, of 2e-4 rad at most: their squares are within a few millionths of a newton metre.
    """
    model = _model(robot)
    data = model.createData()
    compliance = 1e-7 * np.array([[4.0, 1.0], [1.0, 9.0]])
    expected = np.empty_like(state.q)
    for k, q in enumerate(state.q):
        weight = sum(inertia.mass for inertia in model.inertias) * np.array([0, 0, -9.81])
        moment = np.cross(pin.centerOfMass(model, data, q), weight)[:2]
        # In axes that turn with the base, gravity turns the other way.
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
    """A mass beside the upright axis is felt by no joint of a level robot, and has the base lean all the same."""
    whole = BaseCompliance().columns(state, None)
    values = state.parameters.copy()
    values[_rigid(state.model)[:10]] = 0.0
    without = situation(state.model, values, state.t, state.q, state.dq, state.ddq)
    poorer = BaseCompliance().columns(without, None)
    # Of bolts alike about both axes, on the joints behind the link: gravity askew turns the first one too.
    lost = (whole - poorer)[:, 1:, :2].sum(axis=2).ravel()
    own = poorer[:, 1:, 3:].reshape(-1, 2)
    rest = lost - own @ np.linalg.lstsq(own, lost, rcond=None)[0]
    assert np.abs(lost).max() > 1.0
    assert np.abs(rest).max() < 1e-9 * np.abs(lost).max()


def test_it_is_told_in_words_and_read_from_its_name(robot: Robot) -> None:
    """Compliances by axis, and a sentence with the largest of them."""
    effect = find_effect("pattern:leaning:0:even")
    assert isinstance(effect, BaseCompliance)
    units = [(c.name, c.unit) for c in effect.parameters(robot, None)]
    assert units[0] == ("compliance_1", "rad/(N m)")
    assert units[-1] == ("own_2", "rad")
    assert "0.29 deg per 1000 N m" in effect.describe(None, np.array([5e-6, 1e-6, 0.0, 0.3, 0.2]))
    # No base leans against its load.
    assert "under the robot's weight" not in effect.describe(None, np.array([-5e-6, 1e-6, 0.0, 0.3, 0.2]))
