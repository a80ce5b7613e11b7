"""Specification of a body at the flange that changes slowly: pinocchio's torque of it, times the mass that is left."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from estimation.diagnosis.draining import Draining
from estimation.diagnosis.extension import find_effect
from estimation.diagnosis.patterns import is_of_time
from robots import load_robot
from robots.regressor import default_model
from robots.robot import Robot
from robots.terms.effects import situation

COM = np.array([0.03, -0.02, 0.1])  # [m] in the flange's frame


def _torque(robot: Robot, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
    """Torque (N, n) of a kilogramme on the flange, by pinocchio's model of the chain, which has no other body."""
    model, parent = pin.Model(), 0
    for joint in robot.chain.joints:
        placement = pin.SE3(np.asarray(joint.rotation), np.asarray(joint.translation))
        parent = model.addJoint(parent, pin.JointModelRevoluteUnaligned(np.asarray(joint.axis)), placement, joint.name)
    tip = pin.SE3(np.asarray(robot.chain.tip)[:3, :3], np.asarray(robot.chain.tip)[:3, 3])
    model.appendBodyToJoint(parent, pin.Inertia(1.0, COM, np.zeros((3, 3))), tip)
    data = model.createData()
    return np.array([pin.rnea(model, data, *row) for row in zip(q, dq, ddq, strict=True)])


def test_a_tank_that_empties_is_within_its_columns() -> None:
    """Its torque is met to a twelfth of the largest, at the ends of the waves, and what it lost is told to a tenth."""
    robot = load_robot("ur10")
    t = 0.02 * np.arange(500)
    rates = np.array([0.9, 1.1, 1.3, 1.7, 2.1, 2.6])
    q = 0.6 * np.sin(np.outer(t, rates))
    dq, ddq = 0.6 * rates * np.cos(np.outer(t, rates)), -0.6 * rates**2 * np.sin(np.outer(t, rates))
    model = default_model(robot)
    state = situation(model, model.nominal, 100.0 + t, q, dq, ddq)
    kilogramme = _torque(robot, q, dq, ddq)
    lost = 2.0 * np.exp(-t / 6.0)
    extra = kilogramme * lost[:, None]
    # The base model has a payload that stays.
    stays = state.sensitivity("tool")[:, :, :4]
    X = np.concatenate([Draining().columns(state, None), stays], axis=2)
    rows = X.reshape(-1, X.shape[2])
    values = np.linalg.lstsq(rows, extra.ravel(), rcond=None)[0]
    np.testing.assert_allclose(rows @ values, extra.ravel(), atol=0.08 * np.abs(extra).max())
    told = Draining().describe(None, values[:-4])
    assert float(told.split("does: by ")[1].split(" kg")[0]) == pytest.approx(np.ptp(lost), rel=0.1)


def test_it_is_of_a_whole_robot_and_goes_by_time(arm: Robot) -> None:
    """A model file names it; two joints cannot tell a body from what each of them does."""
    found = find_effect(Draining.name)
    assert isinstance(found, Draining)
    assert is_of_time(found)
    assert found.joints(load_robot("ur10")) == (None,)
    assert found.joints(arm) == ()
