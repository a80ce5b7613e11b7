"""A controller to test against: it takes points, plays them on the virtual robot, and makes faults on request."""

from oed.controllers.virtual.controller import VirtualController
from oed.controllers.virtual.starting import virtual_controller

__all__ = ["VirtualController", "virtual_controller"]
