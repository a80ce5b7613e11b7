"""The torque model and its regressor."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest

from robots.common.errors import InputError
from robots.loading import load_robot
from robots.regressor import TorqueModel, default_model
from robots.terms import FrictionPolynomial, RigidBody, RotorInertia, TorqueOffset


@pytest.fixture
def model(catalogue_robot):
    return default_model(catalogue_robot("er3a"))


def test_the_default_model(model):
    """The default model is rigid body, friction polynomial, rotor inertia and torque offset, in this order."""
    assert model.size == 60 + 24 + 6 + 6
    assert model.names[:2] == ("m_1", "mPx_1")
    assert model.names[60:66] == ("f1_1", "f2_1", "f3_1", "f4_1", "f1_2", "f2_2")
    assert model.names[84:92] == ("Im_1", "Im_2", "Im_3", "Im_4", "Im_5", "Im_6", "offset_1", "offset_2")
    np.testing.assert_array_equal(model.nominal[:60].reshape(6, 10), model.robot.inertia)
    np.testing.assert_array_equal(model.nominal[60:84].reshape(6, 4), model.robot.friction)


def test_parts_can_be_left_out(model):
    """Friction may be Coulomb and viscous alone, rotor inertia and offset may be left out."""
    small = default_model(model.robot, friction="coulomb-viscous", velocity_scale=0.02, rotor=False, offset=False)
    assert small.terms == (RigidBody(), FrictionPolynomial(powers=(1, 2), velocity_scale=0.02))
    with pytest.raises(InputError, match="friction model 'stiction'; allowed: polynomial, coulomb-viscous"):
        default_model(model.robot, friction="stiction")


def test_torque_is_that_of_its_terms(model, twin, states):
    """Torque is pinocchio's rigid-body torque, plus friction, plus rotor inertia, plus offset."""
    q, dq, ddq = states(model.robot, 40)
    robot, pi = model.robot, model.nominal.copy()
    pi[-6:] = offset = np.arange(6.0)
    shapes = np.stack([np.sign(dq), dq, dq * np.abs(dq), dq**3], axis=2)
    expected = twin(robot).torque(q, dq, ddq, robot.inertia)
    expected += np.sum(shapes * robot.friction, axis=2) + robot.rotor_inertia * ddq + offset
    # 1e-9 of the torque's scale: the accuracy that the design asks for
    np.testing.assert_allclose(model.torque(q, dq, ddq, pi), expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_rows_go_sample_by_sample_joint_by_joint(model, states):
    """Y (N, n, p) reshaped to (N n, p) lists the joints of the first sample, then those of the second."""
    state = states(model.robot, 3)
    Y = model.regressor(*state)
    rows = Y.reshape(-1, model.size)
    alone = model.regressor(*(array[1] for array in state))  # one sample, without its axis
    np.testing.assert_allclose(rows[6:12], alone[0], rtol=1e-12, atol=1e-12)  # other code may run for one sample
    np.testing.assert_allclose(
        model.symbolic()(*(array[1] for array in state)).full(), alone[0], rtol=1e-12, atol=1e-12
    )


def test_some_columns(model, states):
    """Chosen columns come alone and in the order asked for, in regressor, torque and CasADi function."""
    state, columns = states(model.robot, 4), [60, 9, 90]
    whole = model.regressor(*state)[:, :, columns]
    part = model.regressor(*state, columns=columns)
    np.testing.assert_allclose(part, whole, rtol=1e-12, atol=1e-12)  # simplified by itself, it rounds otherwise
    torque = model.torque(*state, [1.0, 2.0, 3.0], columns=columns)
    np.testing.assert_allclose(torque, whole @ [1.0, 2.0, 3.0], rtol=1e-12, atol=1e-12)
    assert model.symbolic(columns).size_out(0) == (6, 3)
    with pytest.raises(InputError, match=r"\(2,\) parameters; allowed: \(3,\)"):
        model.torque(*state, [1.0, 2.0], columns=columns)
    with pytest.raises(InputError, match=r"allowed: \(96,\)"):
        model.torque(*state, np.ones((96, 1)))


def test_out_is_reused(model, states):
    """An array given as `out` holds the result and is returned."""
    state = states(model.robot, 5)
    out = np.full((5, 6, model.size), np.nan)
    assert model.regressor(*state, out=out) is out
    np.testing.assert_array_equal(out, model.regressor(*state))


def test_long_logs_are_treated_in_parts(model, states):
    """Torque at the border of the parts into which a long log is cut equals that of each sample alone."""
    state = states(model.robot, 4097)
    tau = model.torque(*state, model.nominal)
    tail = model.torque(*(array[-2:] for array in state), model.nominal)
    np.testing.assert_allclose(tau[-2:], tail, rtol=1e-12)  # products of matrices of other shapes round otherwise


@pytest.mark.parametrize("position", [0, 1, 2])
def test_a_motion_of_other_joints_is_refused(position, model):
    """Positions, velocities and accelerations must all be of the robot's joints and of as many samples."""
    for shape in ((5, 5), (4, 6)):
        arrays = [np.zeros((5, 6)) for _ in range(3)]
        arrays[position] = np.zeros(shape)
        with pytest.raises(InputError, match=r"argument \d has shape"):
            model.regressor(*arrays)


@pytest.mark.parametrize(("name", "seed"), [("er3a", None), (None, 3), (None, 5)])
def test_the_adjoint_is_the_gradient(name, seed, catalogue_robot, random_robot, twin, states):
    """The adjoint is the gradient of sum(Ybar * Y), by central differences of pinocchio's regressor."""
    robot = catalogue_robot(name) if name else random_robot(seed, 5)
    model, oracle = TorqueModel(robot, (RigidBody(),)), twin(robot)
    state = states(robot, 1)
    weights = np.random.default_rng(2).normal(size=10 * robot.n**2)
    gradients = model.adjoint()(*(array[0] for array in state), weights)
    step = 1e-5
    for which, gradient in enumerate(gradients):
        numeric = np.empty(robot.n)
        for joint in range(robot.n):
            change = np.zeros_like(state)
            change[which, 0, joint] = step
            sides = [oracle.regressor(*(state + sign * change)).ravel() @ weights for sign in (1, -1)]
            numeric[joint] = (sides[0] - sides[1]) / (2 * step)
        # The third derivative times step^2 / 6, and rounding over the step, are both near 1e-10 of the gradient.
        np.testing.assert_allclose(gradient.full().ravel(), numeric, rtol=0, atol=1e-6 * np.abs(numeric).max())


def test_the_adjoint_of_all_terms(model, states):
    """The adjoint of chosen columns, friction's tanh included, is the transposed Jacobian times the weights."""
    import casadi

    model = default_model(model.robot, velocity_scale=0.02)
    columns = [5, 9, 17, 60, 61, 64, 86, 90]
    symbols = [casadi.SX.sym(name, 6) for name in ("q", "dq", "ddq")]
    Y = model.symbolic(columns)(*symbols)
    entries = casadi.vec(casadi.densify(Y).T)
    jacobians = casadi.Function("J", symbols, [casadi.jacobian(entries, symbol) for symbol in symbols])
    state = [array[0] for array in states(model.robot, 1)]
    weights = np.random.default_rng(0).normal(size=48)
    for gradient, jacobian in zip(model.adjoint(columns)(*state, weights), jacobians(*state), strict=True):
        expected = jacobian.full().T @ weights
        np.testing.assert_allclose(gradient.full().ravel(), expected, rtol=1e-11, atol=1e-11)  # sums of 48 products


def test_a_model_crosses_process_borders(model, states):
    """A model pickles, after use too, and gives the same torques afterwards."""
    state = states(model.robot, 3)
    before = model.torque(*state, model.nominal)
    copy = pickle.loads(pickle.dumps(model))
    assert copy.names == model.names
    np.testing.assert_array_equal(copy.torque(*state, copy.nominal), before)


def test_terms_choose_the_columns(model, states):
    """A model of some terms has their columns alone, in the terms' order."""
    few = TorqueModel(model.robot, (TorqueOffset(), RotorInertia()))
    Y = few.regressor(*states(model.robot, 2))
    np.testing.assert_array_equal(Y[:, :, :6], np.broadcast_to(np.eye(6), (2, 6, 6)))
    np.testing.assert_array_equal(Y[:, :, 6:], [np.diag(row) for row in states(model.robot, 2)[2]])


def test_a_model_says_whether_its_robot_is_described():
    """One question for all that needs parameters of the description: a joint without masses is named, with remedies."""
    er3a = load_robot("er3a")
    known = default_model(er3a)
    assert known.described
    np.testing.assert_array_equal(known.require_description("a test"), known.nominal)
    inertia = np.array(er3a.inertia)
    inertia[3] = np.nan
    unknown = default_model(replace(er3a, inertia=inertia))
    assert not unknown.described
    with pytest.raises(InputError, match=r"joint 4: a test needs masses, .* er3a does not state; .*--assume-masses KG"):
        unknown.require_description("a test")
