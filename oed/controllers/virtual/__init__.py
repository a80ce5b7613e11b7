"""A controller to test against: it takes points, plays them on the virtual robot, and can be told to be bad."""

from oed.controllers.virtual.controller import VirtualController
from oed.controllers.virtual.options import ControllerOptions, Faults

__all__ = ["ControllerOptions", "Faults", "VirtualController"]
