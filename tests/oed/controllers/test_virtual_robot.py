"""The robot behind the controllers to test against."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from oed.controllers.virtual.robot import VirtualRobot
from robots.plants import load_plant
from robots.robot import Robot


def test_effects_hold_at_rest(robot: Robot, tmp_path: Path) -> None:
    """The torque of a robot that stands is that of a motion that stays there, with what a hidden spring adds."""
    path = tmp_path / "plant.yaml"
    path.write_text("{sensors: {torque_noise: 0}, effects: [{effect: spring, joint: 2, parameters: {stiffness: 8}}]}")
    virtual = VirtualRobot(load_plant(path, robot), 0.004)
    q = robot.limits.home + 0.3
    zero = np.zeros((5, robot.n))
    followed = virtual.follow(0.004 * np.arange(5), np.tile(q, (5, 1)), zero, zero)
    np.testing.assert_allclose(virtual.stand(q), followed[-1], atol=1e-12)
    bare = VirtualRobot(load_plant(path, robot), 0.004)
    assert abs(bare.stand(q)[1] - bare.stand(robot.limits.home)[1]) > 1.0
