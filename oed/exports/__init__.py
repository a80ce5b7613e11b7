"""Trajectories as files."""

from oed.exports.trajectory_csv import read_trajectory, write_trajectory

FORMS = ("csv",)
"""The forms in which a trajectory goes to a controller."""

__all__ = ["FORMS", "read_trajectory", "write_trajectory"]
