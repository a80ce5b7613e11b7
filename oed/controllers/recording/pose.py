"""Where the robot stands, as its controller reports it."""

from __future__ import annotations

import time

from oed.controllers.errors import ControllerError
from oed.controllers.interrupts import signals_held
from oed.controllers.links import open_link
from oed.controllers.options import Endpoint
from oed.controllers.recording.feedback import Layout
from oed.controllers.recording.recorder import Recorder
from robots.common.arrays import Array
from robots.robot import Robot


def require_torque(layout: Layout, endpoint: Endpoint) -> None:
    """Refuses feedback without torque.

    Raises:
        ControllerError: it carries neither torque nor current.
    """
    if not layout.effort:
        raise ControllerError(
            f"the feedback of {endpoint.place(endpoint.state_port)} carries neither torque nor current",
            remedy="no driver of ROS-Industrial sends them: extend the controller's program by message type 9015, or "
            "record torque at the controller and use `oed diagnose`",
        )


def read_pose(robot: Robot, endpoint: Endpoint, patience: float = 2.0, *, needs_torque: bool = False) -> Array:
    """Waits until a robot stands, and reads its pose (n,) [rad or m].

    A controller whose client was killed may go on with the points that it holds.

    Args:
        robot: the robot.
        endpoint: its controller.
        patience: longest silence [s].
        needs_torque: refuse a controller whose feedback carries neither torque nor current.

    Returns:
        The pose (n,) [rad or m].

    Raises:
        ControllerError: no torque where it is needed.
        LinkError: the controller cannot be reached, or is silent.
    """
    recorder = Recorder(open_link(endpoint, endpoint.state_port), robot, endpoint.form, patience, endpoint.connect_time)
    try:
        recorder.wait_for_feedback()
        if needs_torque:
            require_torque(recorder.layout, endpoint)
        # How long the robot must stand [s].
        while time.monotonic() - recorder.rest_since < 0.3:
            time.sleep(0.02)
            recorder.check()
        assert recorder.positions is not None
        return recorder.positions[: robot.n]
    finally:
        with signals_held():
            recorder.finish({})
