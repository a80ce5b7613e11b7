"""Ways to a controller: play a trajectory, record the feedback, and a controller to test against."""

from __future__ import annotations

from oed.controllers.clients.options import StreamOptions
from oed.controllers.clients.playing import stream
from oed.controllers.clients.result import StreamResult
from oed.controllers.drivers import Driver, driver_of
from oed.controllers.errors import ControllerError, LinkError
from oed.controllers.links import Endpoint
from oed.controllers.recording.pose import read_pose
from oed.controllers.recording.recording import Recording, record
from oed.controllers.virtual import ControllerOptions, Faults, VirtualController, virtual_controller

__all__ = [
    "ControllerError",
    "ControllerOptions",
    "Driver",
    "Endpoint",
    "Faults",
    "LinkError",
    "Recording",
    "StreamOptions",
    "StreamResult",
    "VirtualController",
    "driver_of",
    "read_pose",
    "record",
    "stream",
    "virtual_controller",
]
