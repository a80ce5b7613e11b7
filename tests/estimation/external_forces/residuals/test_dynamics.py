"""Momentum, beta and Jacobian against pinocchio."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from estimation.external_forces.residuals.dynamics import dynamics_of
from robots import load_robot
from robots.common.errors import InputError
from robots.regressor import TorqueModel
from robots.terms import FrictionPolynomial
from robots.terms.situations.flange_body import point_mass


def states(n, seed=0, count=20):
    return np.random.default_rng(seed).uniform(-1.5, 1.5, (2, count, n))


@pytest.mark.parametrize("name", ["limb", "er3a"])
@pytest.mark.slow
def test_momentum_and_beta_are_those_of_pinocchio(limb, twin_of, model_of, name):
    """P is M dq by crba, and beta is g - C' dq by the Coriolis matrix, with the rotors on the diagonal."""
    robot = limb if name == "limb" else load_robot(name)
    twin, dynamics = twin_of(robot), dynamics_of(model_of(robot))
    q, dq = states(robot.n)
    p, rest, friction, jacobian = dynamics(q, dq)
    rotors = np.asarray(robot.rotor_inertia)
    for k in range(len(q)):
        upper = np.triu(pin.crba(twin.model, twin.data, q[k]))
        M = upper + np.triu(upper, 1).T
        C = pin.computeCoriolisMatrix(twin.model, twin.data, q[k], dq[k])
        g = pin.computeGeneralizedGravity(twin.model, twin.data, q[k])
        # Sums of some hundred products of order one.
        np.testing.assert_allclose(p[k], M @ dq[k] + rotors * dq[k], atol=1e-10)
        np.testing.assert_allclose(rest[k], g - C.T @ dq[k], atol=1e-9)
        np.testing.assert_allclose(jacobian[k], twin.jacobian(q[k]), atol=1e-12)
    f1, f2 = np.asarray(robot.friction)[:, 0], np.asarray(robot.friction)[:, 1]
    np.testing.assert_allclose(friction, f1 * np.tanh(dq / 1e-3) + f2 * dq, atol=1e-9)


def test_tool_point_moves_the_jacobian(exact, twin_of, limb):
    """A tool point in the flange's frame has pinocchio's Jacobian of that point."""
    q, dq = states(3, count=3)
    jacobian = dynamics_of(exact, tool=(0.1, -0.05, 0.2))(q, dq)[3]
    for k in range(3):
        expected = twin_of(limb).jacobian(q[k], 3, np.array([0.45, 0.0, 0.22]))
        np.testing.assert_allclose(jacobian[k], expected, atol=1e-12)


def test_payload_and_gravity_count(exact, twin_of, limb):
    """A point mass at the flange adds m J' J dq to the momentum, and its weight to beta; gravity may be tilted."""
    q, dq = states(3, count=4)
    mass, gravity = 2.0, np.array([1.0, 2.0, -9.0])
    tilted = dynamics_of(replace(exact, provenance={"gravities": [gravity.tolist()]}), gravity=gravity)
    loaded = dynamics_of(
        replace(exact, provenance={"gravities": [gravity.tolist()]}),
        gravity=gravity,
        payload=point_mass(mass, (0.0, 0.0, 0.0)),
    )
    still = np.zeros_like(dq)
    for k in range(4):
        J = twin_of(limb).jacobian(q[k])[:3]
        added = (loaded(q, dq)[0] - tilted(q, dq)[0])[k]
        np.testing.assert_allclose(added, mass * J.T @ J @ dq[k], atol=1e-10)
        weight = (loaded(q, still)[1] - tilted(q, still)[1])[k]
        np.testing.assert_allclose(weight, -mass * J.T @ gravity, atol=1e-10)


def test_variance_is_that_of_the_parameters(exact):
    """With a unit covariance the variance is the squared length of each regressor row, in numbers and symbols."""
    import casadi

    b = len(exact.values)
    known = replace(exact, provenance={"band_covariance": np.eye(b).tolist()})
    dynamics = dynamics_of(known)
    q, dq = states(3, count=5)
    ddq = np.ones_like(q)
    Y = exact.torque_model.regressor(q, dq, ddq, columns=exact.columns)
    np.testing.assert_allclose(dynamics.variance(q, dq, ddq), (Y**2).sum(axis=2), rtol=1e-12)
    symbols = [casadi.SX.sym(name, 3) for name in ("q", "dq", "ddq")]
    function = casadi.Function("v", symbols, [dynamics.variance_expression(*symbols)])
    np.testing.assert_allclose(function(q[0], dq[0], ddq[0]).full()[:, 0], (Y[0] ** 2).sum(axis=1), rtol=1e-10)


def test_model_without_inertia_is_refused(exact, limb):
    """Friction alone does not separate a contact from the arm's inertia; the message says what to do."""
    friction = TorqueModel(limb, (FrictionPolynomial(powers=(1, 2)),))
    count = friction.size
    bare = replace(
        exact,
        torque_model=friction,
        columns=tuple(range(count)),
        values=np.ones(count),
        covariance=np.eye(count),
        determined=np.ones(count, dtype=bool),
        formulas=("",) * count,
    )
    with pytest.raises(InputError, match=r"no inertial parameters.*oed identify"):
        dynamics_of(bare)


def test_robot_without_flange_is_refused(exact, limb):
    """A model file that does not state the flange has no tool; a tool point must be three numbers."""
    unknown = replace(limb, assumed=("chain.tip",))
    model = replace(exact, torque_model=TorqueModel(unknown, exact.torque_model.terms))
    with pytest.raises(InputError, match="pose of the flange"):
        dynamics_of(model)
    with pytest.raises(InputError, match="three finite numbers"):
        dynamics_of(exact, tool=(0.1, 0.2))
