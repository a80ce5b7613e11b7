"""The information matrix against pinocchio, and its reverse mode against a forward one."""

from __future__ import annotations

import casadi
import numpy as np
import pinocchio as pin
import pytest

from oed.criteria import Information
from robots.loading import load_robot
from robots.regressor import TorqueModel, default_model
from robots.robot import Robot

SCALE = 0.02
TO_OURS = [0, 1, 2, 3, 4, 5, 7, 6, 8, 9]  # pinocchio lists Iyy before Ixz


def pinocchio_model(robot: Robot) -> pin.Model:
    model, parent = pin.Model(), 0
    model.gravity.linear = np.array(robot.chain.gravity)
    for joint in robot.chain.joints:
        placement = pin.SE3(np.array(joint.rotation), np.array(joint.translation))
        parent = model.addJoint(parent, pin.JointModelRevoluteUnaligned(np.array(joint.axis)), placement, joint.name)
    return model


def oracle(robot: Robot, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
    """The whole regressor (N n, p) of rigid body, Coulomb and viscous friction and rotors, without our code."""
    model, n = pinocchio_model(robot), robot.n
    data = model.createData()
    order = np.concatenate([10 * link + np.array(TO_OURS) for link in range(n)])
    rows = []
    for state in zip(q, dq, ddq, strict=True):
        rigid = np.array(pin.computeJointTorqueRegressor(model, data, *state))[:, order]
        friction = np.zeros((n, 2 * n))
        friction[range(n), range(0, 2 * n, 2)] = np.tanh(state[1] / SCALE)
        friction[range(n), range(1, 2 * n, 2)] = state[1]
        rows.append(np.hstack([rigid, friction, np.diag(state[2])]))
    return np.vstack(rows)


@pytest.fixture(scope="module")
def model() -> TorqueModel:
    return default_model(load_robot("er3a"), friction="coulomb-viscous", velocity_scale=SCALE, offset=False)


@pytest.fixture(scope="module")
def states() -> np.ndarray:
    return np.random.default_rng(1).uniform(-2, 2, (3, 30, 6))


COLUMNS = [9, 11, 14, 25, 29, 40, 59, 60, 61, 70, 71, 74, 77]


def test_gram(model: TorqueModel, states: np.ndarray) -> None:
    """Y'Y over samples and joints is that of pinocchio's regressor with friction and rotors beside it."""
    Y = oracle(model.robot, *states)[:, COLUMNS]
    information = Information(model, COLUMNS)
    # Rounding of two recursions of six links.
    np.testing.assert_allclose(information.gram(*states), Y.T @ Y, atol=1e-10 * np.abs(Y.T @ Y).max())


def test_gram_forgets_the_last_motion(model: TorqueModel, states: np.ndarray) -> None:
    """The memory that is used again, also by motions of other lengths, leaves no trace."""
    used, fresh = Information(model, COLUMNS), Information(model, COLUMNS)
    used.gram(*states)
    used.gram(*-states)
    used.gram(*states[:, :7])
    np.testing.assert_array_equal(used.gram(*states), fresh.gram(*states))


def test_pullback(model: TorqueModel, states: np.ndarray) -> None:
    """The gradients of sum(W * Y'Y) by q, dq and ddq are those of CasADi's forward Jacobian of the regressor."""
    random = np.random.default_rng(2)
    weights = random.normal(size=(len(COLUMNS), len(COLUMNS)))
    weights = weights + weights.T
    information = Information(model, COLUMNS)
    information.gram(*states)
    gradients = information.pullback(weights)
    symbols = [casadi.SX.sym(name, 6) for name in ("q", "dq", "ddq")]
    Y = casadi.densify(model.symbolic(COLUMNS)(*symbols))
    jacobian = casadi.Function("J", symbols, [casadi.jacobian(casadi.vec(Y), s) for s in symbols])
    value = casadi.Function("Y", symbols, [Y])
    for k, state in enumerate(zip(*states, strict=True)):
        by_Y = 2 * np.array(value(*state)) @ weights  # of trace(W Y'Y)
        for gradient, J in zip(gradients, jacobian(*state), strict=True):
            expected = by_Y.reshape(-1, order="F") @ np.array(J)
            np.testing.assert_allclose(gradient[k], expected, atol=1e-10 * np.abs(expected).max())


def test_pullback_follows_differences(model: TorqueModel, states: np.ndarray) -> None:
    """The gradient of log det(Y'Y) follows differences of an independent regressor."""
    information = Information(model, COLUMNS)
    gram = information.gram(*states)
    gradients = information.pullback(np.linalg.inv(gram))
    direction = np.random.default_rng(3).normal(size=states.shape)

    def value(step: float) -> float:
        Y = oracle(model.robot, *(states + step * direction))[:, COLUMNS]
        return np.linalg.slogdet(Y.T @ Y)[1]

    slope = sum(np.sum(g * d) for g, d in zip(gradients, direction, strict=True))
    # Velocities are large against the scale of tanh nearly everywhere, so that third derivatives stay moderate.
    assert slope == pytest.approx((value(1e-6) - value(-1e-6)) / 2e-6, rel=1e-5)


def test_pullback_needs_a_gram(model: TorqueModel) -> None:
    """Gradients without a motion are a mistake of the program, and said to be."""
    with pytest.raises(RuntimeError, match="gram"):
        Information(model, COLUMNS).pullback(np.eye(len(COLUMNS)))
