"""A recording says where the controller has other joints than the robot."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from oed.controllers import record, stream
from oed.controllers.recording.reported_joints import doubts_about_robot
from robots.common.errors import InputError, OtherRobotWarning
from robots.loading import load_robot
from tests.oed.controllers.conftest import swing


def ten(*values: float) -> np.ndarray:
    """Positions as feedback holds them: ten reals, zero where there is no joint."""
    return np.array([*values, *[0.0] * (10 - len(values))])


def test_doubts() -> None:
    """Last joints that read zero, and positions that the robot cannot have; a robot in its limits gives none."""
    panda = load_robot("panda")
    pose = ten(*panda.limits.home + 0.01)
    assert doubts_about_robot(panda, pose - 0.001, pose) == []
    silent, outside = doubts_about_robot(panda, ten(0.1, -0.2, 0.3, 0.2, 0.1, 0.5), ten(0.2, 0.1, 0.4, 0.4, 0.2, 0.6))
    assert "joint 7 of panda reads exactly 0 all the time" in silent
    assert "the controller has 6 joints" in silent
    assert "joint 4 is reported at 0.4 rad, outside the limits of panda" in outside
    turned = np.degrees(panda.limits.home)
    assert any(
        "may be of another robot, or send degrees" in text
        for text in doubts_about_robot(panda, ten(*turned), ten(*turned))
    )
    # A robot that stands at zero says nothing of its joints.
    assert not [text for text in doubts_about_robot(load_robot("er3a"), ten(), ten()) if "exactly 0" in text]


@pytest.mark.slow
def test_controller_with_fewer_joints(robot, controllers, log: Path) -> None:
    """A robot of more joints than the controller has is noted; the log stays."""
    _, endpoint = controllers(pose=(0.3, 0.2))
    er3a = load_robot("er3a")
    with pytest.warns(OtherRobotWarning, match="joint 3, 4, 5, 6 of er3a reads exactly 0"):
        record(er3a, endpoint, log, duration=0.3)
    assert log.exists()
    with warnings.catch_warnings():
        warnings.simplefilter("error", OtherRobotWarning)
        record(robot, endpoint, log, duration=0.3, force=True)


@pytest.mark.slow
def test_controller_with_more_joints(robot, controllers, log: Path) -> None:
    """A robot of fewer joints than the controller reports is refused, before a log is written."""
    _, endpoint = controllers(pose=(0.3, 0.2))
    chain = replace(robot.chain, joints=robot.chain.joints[:1])
    limits = replace(
        robot.limits,
        **{name: getattr(robot.limits, name)[:1] for name in ("lower", "upper", "velocity", "acceleration", "jerk")},
        torque=robot.limits.torque[:1],
        torque_rms=robot.limits.torque_rms[:1],
        kinds=robot.limits.kinds[:1],
    )
    one = type(robot)(name="one", chain=chain, limits=limits)
    with pytest.raises(InputError, match="the controller reports a joint 2, one has 1"):
        record(one, endpoint, log, duration=0.3)
    with pytest.raises(InputError, match="the controller reports a joint 2, one has 1"):
        stream(swing(one), one, endpoint, log=log)
    assert not log.exists()
