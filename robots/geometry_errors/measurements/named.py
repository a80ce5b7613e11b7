"""Measurements by their names."""

from __future__ import annotations

from robots.common.errors import InputError
from robots.geometry_errors.measurements.base import Measurement
from robots.geometry_errors.measurements.distances import Distances
from robots.geometry_errors.measurements.inclinometer import Inclinometer
from robots.geometry_errors.measurements.markers import Markers
from robots.geometry_errors.measurements.poses import BodyPoses


def measurement_of(option: str, text: str) -> Measurement:
    """Makes the measurement that a text names.

    Args:
        option: for the message.
        text: such as "markers:3".

    Raises:
        InputError: another name, or a number that is none.
    """
    name, _, number = text.partition(":")
    if number and not (number.isdigit() and int(number) > 0):
        allowed = "a number of markers or anchors of 1 or more, as markers:3"
        raise InputError(f"{option} {text}", allowed=allowed)
    if name == "markers":
        return Markers(count=int(number or 1))
    if name == "distances":
        return Distances(count=int(number or 1))
    if name == "poses" and not number:
        return BodyPoses()
    if name == "inclinometer" and not number:
        return Inclinometer()
    allowed = "markers, markers:N, poses, distances, distances:N or inclinometer"
    raise InputError(f"{option} {text}", allowed=allowed)
