"""Trajectories as files."""

from oed.exports.forms import FORMS as CONTROLLER_FORMS
from oed.exports.forms import ExportOptions
from oed.exports.trajectory_checks import check_trajectory, is_made_for
from oed.exports.trajectory_csv import read_trajectory, write_trajectory
from oed.exports.waypoints import read_waypoints, shorter_way
from oed.exports.writing import export_trajectory

FORMS = ("csv", *CONTROLLER_FORMS)
"""The forms in which a trajectory goes to a controller."""

__all__ = [
    "CONTROLLER_FORMS",
    "FORMS",
    "ExportOptions",
    "check_trajectory",
    "export_trajectory",
    "is_made_for",
    "read_trajectory",
    "read_waypoints",
    "shorter_way",
    "write_trajectory",
]
