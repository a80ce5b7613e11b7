"""Kinds of measurements of a flange, one idea a file."""

from robots.geometry_errors.measurements.base import Evaluation, Measurement
from robots.geometry_errors.measurements.camera import CameraBoard
from robots.geometry_errors.measurements.distances import Distances
from robots.geometry_errors.measurements.held_part import HeldPart
from robots.geometry_errors.measurements.inclinometer import Inclinometer
from robots.geometry_errors.measurements.markers import Markers
from robots.geometry_errors.measurements.poses import BodyPoses
from robots.geometry_errors.measurements.setup import Setup, Unknown
from robots.geometry_errors.measurements.touches import Planes, Points

__all__ = [
    "BodyPoses",
    "CameraBoard",
    "Distances",
    "Evaluation",
    "HeldPart",
    "Inclinometer",
    "Markers",
    "Measurement",
    "Planes",
    "Points",
    "Setup",
    "Unknown",
]
