"""Models that cannot be simulated, and the nearest that can."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from estimation import identify
from estimation.models.model import Model
from estimation.predictions.simulability import find_unfit_direction
from robots.common.errors import InputError
from robots.plants import nominal_plant, simulate
from robots.robot import Robot
from robots.signals import Motion
from tests.oed.campaigns.conftest import arm

pytestmark = pytest.mark.slow


def motion() -> Motion:
    """Both joints at several frequencies."""
    t = 0.004 * np.arange(4000)
    w = 2 * np.pi * np.array([[0.2, 0.5, 0.9], [0.3, 0.4, 1.1]])
    size = np.array([[0.8, 0.2, 0.1], [0.7, 0.3, 0.08]])
    angle = t[:, None, None] * w
    q, dq = (size * np.sin(angle)).sum(axis=2), (size * w * np.cos(angle)).sum(axis=2)
    return Motion(t, q, dq, -(size * w**2 * np.sin(angle)).sum(axis=2))


def inertia_matrix(model: Model, q: NDArray[np.float64]) -> NDArray[np.float64]:
    """The inertia matrix at a pose, from torques of unit accelerations."""
    n = len(q)
    rest = model.torque(q[None], np.zeros((1, n)), np.zeros((1, n)))[0]
    return np.column_stack([model.torque(q[None], np.zeros((1, n)), unit[None])[0] - rest for unit in np.eye(n)])


def inertia_matrix_of(robot: Robot, q: NDArray[np.float64]) -> NDArray[np.float64]:
    """The described inertia matrix at a pose, by the plant's torques of unit accelerations."""
    plant, n = nominal_plant(robot), robot.n
    zero = np.zeros((1, n))
    rest = plant.model.torque(q[None], zero, zero, plant.parameters)[0]
    return np.column_stack(
        [plant.model.torque(q[None], zero, unit[None], plant.parameters)[0] - rest for unit in np.eye(n)]
    )


@pytest.fixture(scope="module")
def model() -> Model:
    """An arm identified from a good log."""
    robot = arm()
    return identify(robot, [simulate(nominal_plant(robot), motion())], friction="coulomb-viscous").model


def spoilt(model: Model, joint: int) -> Model:
    """The model with less inertia of one joint than none."""
    own = [
        inertia_matrix(replace(model, values=row), np.zeros(2))[joint - 1, joint - 1]
        for row in np.eye(len(model.values))
    ]
    link = np.array([column.joint == joint and column.term == "rigid_body" for column in model.parameters])
    most = int(np.where(link, own, -np.inf).argmax())
    values = np.array(model.values)
    values[most] -= 1.2 * inertia_matrix(model, np.zeros(2))[joint - 1, joint - 1] / own[most]
    return replace(model, values=values)


def test_a_good_model_is_fit(model: Model) -> None:
    """A model whose inertia matrix is positive definite everywhere is fit."""
    assert find_unfit_direction(model, motion()) is None


@pytest.mark.parametrize("joint", [1, 2])
def test_body_and_direction_are_named(joint: int, model: Model) -> None:
    """The link, the joint and the missing inertia are those that were spoilt; the nearest model can be simulated."""
    unfit = find_unfit_direction(spoilt(model, joint), [motion()])
    assert unfit is not None
    assert unfit.joints[0] == joint
    # The inertia of joint 1 may also be that of link 2, which it turns.
    assert unfit.body in range(joint, 3)
    described = inertia_matrix_of(arm(), unfit.q)
    assert np.linalg.eigvalsh(inertia_matrix(unfit.nearest, unfit.q) - 0.049 * described)[0] > 0
    spoilt_matrix = inertia_matrix(spoilt(model, joint), unfit.q)
    assert unfit.inertia == pytest.approx(unfit.direction @ spoilt_matrix @ unfit.direction)
    assert unfit.inertia < 0 < unfit.expected
    for q in motion().q[::40]:
        assert (np.linalg.eigvalsh(inertia_matrix(unfit.nearest, q)) > 0).all()
    assert find_unfit_direction(unfit.nearest, motion()) is None
    assert unfit.needed > unfit.value
    text = unfit.summary()
    assert f"moving joint {joint}" in text
    assert f"Link {unfit.body} makes it so: {unfit.parameter} is" in text


def test_wrong_motions(model: Model) -> None:
    """A motion of another number of joints is refused."""
    other = Motion(np.zeros(1), *(np.zeros((1, 3)),) * 3)
    with pytest.raises(InputError, match="a motion of 3 joints"):
        find_unfit_direction(model, other)
