"""Tests of an elastic force at the flange that depends on its position, against pinocchio's kinematics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from estimation.models.extension import find_effect
from robots import load_robot
from robots.regressor import default_model
from robots.robot import Robot
from robots.terms.discrepancies.flange_spring import FlangeSpring
from robots.terms.effects import Situation, situation
from tests.estimation.diagnosis.pinocchio_chains import chain_of

PLACE = np.array([0.03, -0.02, 0.12])


@pytest.fixture(scope="module")
def robot() -> Robot:
    """Returns a robot of six joints with a flange that is offset from the last link's frame."""
    found = load_robot("ur10")
    tip = np.eye(4)
    tip[:3, 3] = PLACE
    return replace(found, chain=replace(found.chain, tip=tip))


@pytest.fixture(scope="module")
def state(robot: Robot) -> Situation:
    """Returns two hundred rows of a motion of all joints."""
    t = 0.02 * np.arange(200)
    rates = np.array([0.9, 1.1, 1.3, 1.7, 2.1, 2.6])
    q = np.array([0.3, -1.2, 1.4, -0.6, -1.2, 0.4]) + 0.6 * np.sin(np.outer(t, rates))
    dq, ddq = 0.6 * rates * np.cos(np.outer(t, rates)), -0.6 * rates**2 * np.sin(np.outer(t, rates))
    model = default_model(robot)
    return situation(model, np.zeros(model.size), t, q, dq, ddq)


def _kinematics(robot: Robot, state: Situation) -> tuple[np.ndarray, np.ndarray]:
    """Computes the flange's positions (N, 3) and Jacobians (N, 3, n) by a pinocchio model of the same chain."""
    model, parent = chain_of(robot)
    frame = model.addFrame(pin.Frame("flange", parent, pin.SE3(np.eye(3), PLACE), pin.FrameType.OP_FRAME))
    data = model.createData()
    places, jacobians = [], []
    for q in state.q:
        jacobians.append(pin.computeFrameJacobian(model, data, q, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)[:3])
        pin.framesForwardKinematics(model, data, q)
        places.append(data.oMf[frame].translation.copy())
    return np.array(places), np.array(jacobians)


def test_the_columns_are_the_torque_against_springs_at_the_flange(robot: Robot, state: Situation) -> None:
    """For a stiffness matrix and a constant force the columns give -J' f to rounding."""
    places, jacobians = _kinematics(robot, state)
    stiffness, steady = (
        np.array([[-30.0, 4.0, 1.0], [4.0, -20.0, -2.0], [1.0, -2.0, -50.0]]),
        np.array([3.0, -2.0, 7.0]),
    )
    expected = -np.einsum("tin,ti->tn", jacobians, places @ stiffness.T + steady)
    coefficients = np.concatenate([steady, *stiffness.T])
    assert FlangeSpring().columns(state, None) @ coefficients == pytest.approx(expected, abs=1e-9)


def test_it_is_reported_in_words_and_read_from_its_name(robot: Robot) -> None:
    """The effect is found by its name, has three forces and nine stiffnesses, and describes the largest stiffness."""
    effect = find_effect("pattern:pulling:0:even")
    assert isinstance(effect, FlangeSpring)
    units = [(c.name, c.unit) for c in effect.parameters(robot, None)]
    assert len(units) == 12
    assert units[1] == ("force_y", "N")
    assert units[4] == ("stiffness_yx", "N/m")
    assert "40 N/m" in effect.describe(None, np.array([90.0, 0, 0, -40.0, 1.0, *np.zeros(7)]))
