"""Joint friction as a polynomial of the velocity."""

from __future__ import annotations

import numpy as np
import pytest

from robots.common.errors import InputError
from robots.geometry.chain import Joint
from robots.regressor import TorqueModel
from robots.terms import COULOMB_VISCOUS, FINE_BENDS, BendingFriction, FrictionPolynomial

DQ = np.array([[-2.0, 0.0], [0.0, 0.5], [1e-9, -0.3], [3.0, 4.0]])
EXACT = 1e-15  # a few multiplications


@pytest.fixture
def robot(made_robot):
    turn = Joint("turn", "revolute", np.eye(3), np.zeros(3))
    return made_robot([turn, Joint("slide", "prismatic", np.eye(3), np.zeros(3))])


def torque(robot, term, f):
    model = TorqueModel(robot, (term,))
    return model.torque(DQ, DQ, DQ, f)


def test_the_polynomial(robot):
    """Friction is f1 sign(dq) + f2 dq + f3 dq |dq| + f4 dq^3 on each joint, and the sign of zero is zero."""
    f = np.arange(1.0, 9.0)
    a, b = f[:4], f[4:]
    shapes = np.stack([np.sign(DQ), DQ, DQ * np.abs(DQ), DQ**3])
    expected = np.column_stack([a @ shapes[:, :, 0], b @ shapes[:, :, 1]])
    np.testing.assert_allclose(torque(robot, FrictionPolynomial(), f), expected, rtol=EXACT, atol=EXACT)
    assert torque(robot, FrictionPolynomial(), f)[1, 0] == 0.0


def test_a_velocity_scale_smooths_the_sign(robot):
    """With a velocity scale v0 the sign is tanh(dq / v0), and the other powers stay as they are."""
    term = FrictionPolynomial(powers=COULOMB_VISCOUS, velocity_scale=0.02)
    expected = np.tanh(DQ / 0.02) * [1.0, 3.0] + DQ * [2.0, 4.0]
    np.testing.assert_allclose(torque(robot, term, [1.0, 2.0, 3.0, 4.0]), expected, rtol=1e-14)  # libm's tanh


def test_some_powers_alone(robot):
    """Any choice of powers gives those columns alone, joint after joint, with the robot's coefficients."""
    term = FrictionPolynomial(powers=(1, 4))
    assert [column.name for column in term.columns(robot)] == ["f1_1", "f4_1", "f1_2", "f4_2"]
    np.testing.assert_array_equal(term.nominal(robot), robot.friction[:, [0, 3]].reshape(-1))


def test_units_follow_the_joint(robot):
    """A turning joint's coefficients are in N m per powers of rad/s, a sliding one's in N per powers of m/s."""
    units = [column.unit for column in FrictionPolynomial().columns(robot)]
    assert units[:4] == ["N m", "N m s/rad", "N m s2/rad2", "N m s3/rad3"]
    assert units[4:] == ["N", "N s/m", "N s2/m2", "N s3/m3"]


@pytest.mark.parametrize("powers", [(), (0,), (5,), (1, 2, 2)])
def test_bad_powers_are_refused(powers):
    """No power, an unknown one or one given twice is refused, with what is allowed."""
    with pytest.raises(InputError, match="allowed: some of 1, 2, 3, 4, each once"):
        FrictionPolynomial(powers=powers)


@pytest.mark.parametrize("scale", [-0.1, np.nan])
def test_a_bad_velocity_scale_is_refused(scale):
    """A velocity scale is zero or positive."""
    with pytest.raises(InputError, match="velocity scale"):
        FrictionPolynomial(velocity_scale=scale)


def test_each_joint_may_have_its_own_velocity_scale(robot):
    """Velocity scales are one for all joints or one each; any other number is refused."""
    expected = np.column_stack([np.tanh(DQ[:, 0] / 0.02), np.sign(DQ[:, 1])])
    np.testing.assert_allclose(
        torque(robot, FrictionPolynomial(powers=(1,), velocity_scale=(0.02, 0.0)), [1, 1]), expected, rtol=1e-14
    )
    with pytest.raises(InputError, match="3 friction velocity scales; allowed: one, or 2"):
        torque(robot, FrictionPolynomial(powers=(1,), velocity_scale=(0.02, 0.0, 1.0)), [1, 1])


@pytest.mark.parametrize("power", [2, 3])
def test_fine_bends_follow_the_polynomial(robot, power):
    """They hold its terms to 2.5 % of what Coulomb and viscous friction leave, at speeds up to the highest one."""
    v = np.linspace(0.01, 1.0, 200)[:, None] * [1.0, 2.0]
    model = TorqueModel(robot, (BendingFriction(speed=(1.0, 2.0), bends=FINE_BENDS),))
    Y = model.regressor(v, v, v).reshape(len(v), 2, 2, 5)
    for joint in (0, 1):
        left = []
        for X in (Y[:, joint, joint, :2], Y[:, joint, joint]):
            y = v[:, joint] ** power
            left.append((y - X @ np.linalg.lstsq(X, y, rcond=None)[0]).std())
        assert left[1] < 0.025 * left[0]
    assert [c.symbol for c in model.columns[:5]] == ["f1", "f2", "f3", "f4", "f5"]


def test_a_bend_of_zero_is_refused():
    """A bend is a share of the highest speed, and positive."""
    with pytest.raises(InputError, match="bends"):
        BendingFriction(bends=(0.1, 0.0))
