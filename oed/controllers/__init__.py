"""Ways to a controller: play a trajectory, record the feedback, and a controller to test against."""

from __future__ import annotations

from oed.controllers.clients.options import StreamOptions
from oed.controllers.clients.playing import stream
from oed.controllers.clients.result import StreamResult
from oed.controllers.errors import ControllerError, LinkError
from oed.controllers.links import Endpoint
from oed.controllers.recording.recording import Recording, record
from oed.controllers.virtual import ControllerOptions, Faults, VirtualController

__all__ = [
    "ControllerError",
    "ControllerOptions",
    "Endpoint",
    "Faults",
    "LinkError",
    "Recording",
    "StreamOptions",
    "StreamResult",
    "VirtualController",
    "record",
    "stream",
]
