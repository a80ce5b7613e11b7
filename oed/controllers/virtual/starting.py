"""The controller to test against that behaves as a driver does."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from oed.controllers.virtual.controller import VirtualController
from oed.controllers.virtual.egm import VirtualEgm
from oed.controllers.virtual.ur.controller import VirtualUr
from oed.controllers.virtual_options import ControllerOptions
from robots.plants import Plant
from robots.robot import Robot


def virtual_controller(
    robot: Robot,
    plant: Plant | None = None,
    *,
    options: ControllerOptions | None = None,
    pose: NDArray[np.float64] | None = None,
    seed: int = 0,
) -> VirtualController | VirtualUr | VirtualEgm:
    """Makes a controller to test against, by the protocol of its driver.

    Args:
        robot: what it controls.
        plant: how that robot really behaves; its description by default.
        options: ports, driver, feedback and faults.
        pose: where the robot stands (n,) [rad or m]; its home by default.
        seed: of the sensors' noise.

    Raises:
        InputError: see `VirtualController`, `VirtualUr` and `VirtualEgm`.
    """
    options = options or ControllerOptions()
    if options.driver is not None and options.driver.protocol == "rtde":
        return VirtualUr(robot, plant, options=options, pose=pose, seed=seed)
    if options.driver is not None and options.driver.protocol == "egm":
        return VirtualEgm(robot, options=options, pose=pose)
    return VirtualController(robot, plant, options=options, pose=pose, seed=seed)
