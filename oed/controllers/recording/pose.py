"""Where the robot stands, as its controller reports it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from oed.controllers.interrupts import signals_held
from oed.controllers.links import Endpoint, open_link
from oed.controllers.recording.recorder import Recorder
from robots.robot import Robot

Array = NDArray[np.float64]


def read_pose(robot: Robot, endpoint: Endpoint, patience: float = 2.0) -> Array:
    """Reads the pose (n,) [rad or m] of a robot.

    Args:
        robot: the robot.
        endpoint: its controller.
        patience: longest silence [s].

    Raises:
        LinkError: the controller cannot be reached, or is silent.
    """
    recorder = Recorder(open_link(endpoint, endpoint.state_port), robot, endpoint.form, patience)
    try:
        return recorder.wait_for_feedback()[: robot.n]
    finally:
        with signals_held():
            recorder.finish({})
