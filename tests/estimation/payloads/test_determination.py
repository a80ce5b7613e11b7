"""What a log does not determine of a payload, and which motion would."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimation.payloads.body import Body
from estimation.payloads.determination import determined, is_nothing, missing_motion, require_determined
from estimation.payloads.intervals import quantities
from estimation.payloads.mounts import Mount
from robots import load_robot
from robots.common.errors import InputError, NotIdentifiableError
from robots.robot import Robot

TRUTH = Body.of(1.0, [0.02, -0.03, 0.1], np.diag([0.003, 0.004, 0.002])).parameters
SPREAD = np.array([0.01, *[0.001] * 3, *[0.0003] * 6])


@pytest.fixture(scope="module")
def ur10() -> Robot:
    """An arm with a wrist of three joints."""
    return load_robot("ur10")


@pytest.fixture(scope="module")
def moving() -> np.ndarray:
    """Positions in which all joints move by more than a radian."""
    t = np.linspace(0, 20, 400)[:, None]
    return np.sin(t * np.array([0.7, 0.9, 1.1, 1.3, 1.7, 2.1]))


def test_a_motion_of_the_whole_wrist_lacks_nothing(ur10: Robot, moving: np.ndarray) -> None:
    """Gravity turns along all axes of the flange."""
    assert missing_motion(Mount(ur10), moving, None) == ""


def test_a_wrist_joint_that_stands_is_named(ur10: Robot, moving: np.ndarray) -> None:
    """With its name, its range, and what to do."""
    still = moving.copy()
    still[:, [4, 5]] = 0.3
    text = missing_motion(Mount(replace(ur10, stated="arm.urdf --tip tool0")), still, None)
    assert "joint 5 (wrist_2_joint, moved 0 deg)" in text
    assert "joint 6 (wrist_3_joint" in text
    assert "joint 4" not in text
    assert "90 deg" in text
    assert "`oed design --robot arm.urdf --tip tool0 --payload-only`" in text


def test_an_axis_of_the_flange_along_which_gravity_does_not_turn_is_named(ur10: Robot, moving: np.ndarray) -> None:
    """Only the vertical first joint moves: gravity is steady along all three axes."""
    still = np.zeros_like(moving)
    still[:, 0] = moving[:, 0]
    assert "gravity turns along x, y, z of the flange" in missing_motion(Mount(ur10), still, None)


def test_good_intervals_pass_and_open_ones_are_refused_by_name(ur10: Robot, moving: np.ndarray) -> None:
    """A mass known to 70 %, and a centre known to 0.2 m along y, end with an error that says so."""
    fine = quantities(TRUTH, np.diag(SPREAD**2), TRUTH)
    require_determined(fine, Mount(ur10), moving, None)
    assert all(determined(fine)[:4])
    heavy = SPREAD.copy()
    heavy[0] = 0.36
    with pytest.raises(NotIdentifiableError, match=r"payload's mass: 1 \(0\.29.* to 1\.7.*\) kg") as caught:
        require_determined(quantities(TRUTH, np.diag(heavy**2), TRUTH), Mount(ur10), moving, None)
    assert caught.value.exit_code == 1
    wide = SPREAD.copy()
    wide[2] = 0.1
    with pytest.raises(NotIdentifiableError, match="centre of mass along y of the flange"):
        require_determined(quantities(TRUTH, np.diag(wide**2), TRUTH), Mount(ur10), moving, None)


def test_a_mass_that_is_surely_negative_is_bad_input(ur10: Robot, moving: np.ndarray) -> None:
    """The logs are swapped, and the exit code is that of bad input."""
    values = -TRUTH
    with pytest.raises(InputError, match="swap --log and --without") as caught:
        require_determined(quantities(values, np.diag(SPREAD**2), TRUTH), Mount(ur10), moving, None)
    assert caught.value.exit_code == 2


@pytest.mark.parametrize(
    ("mass", "nothing"), [(0.0, True), (1.9, True), (2.1, False), (-2.1, True), (-4.9, True), (-5.1, False)]
)
def test_a_mass_within_its_error_is_nothing(ur10: Robot, moving: np.ndarray, mass: float, nothing: bool) -> None:
    """Up to 1.96 standard errors above zero, and to five below; but never where the motion does not show a mass."""
    assert is_nothing(0.1 * mass, 0.1, Mount(ur10), moving, None) == nothing
    still = np.zeros_like(moving)
    still[:, 0] = moving[:, 0]
    assert not is_nothing(0.1 * mass, 0.1, Mount(ur10), still, None)


def test_small_moments_are_marked_as_open_not_refused(ur10: Robot, moving: np.ndarray) -> None:
    """Moments of inertia of a small body hardly show: they are marked."""
    spread = SPREAD.copy()
    spread[4:] = 0.01
    found = quantities(TRUTH, np.diag(spread**2), TRUTH)
    require_determined(found, Mount(ur10), moving, None)
    assert determined(found)[:4] == (True,) * 4
    assert not any(determined(found)[4:])
