"""Trajectories as files."""

from oed.exports.options import ExportOptions as ExportOptions
from oed.exports.trajectory_checks import check_trajectory as check_trajectory
from oed.exports.trajectory_checks import is_made_for as is_made_for
from oed.exports.trajectory_csv import read_trajectory as read_trajectory
from oed.exports.trajectory_csv import write_trajectory as write_trajectory
from oed.exports.waypoints import read_waypoints as read_waypoints
from oed.exports.waypoints import shorter_way as shorter_way
from oed.exports.writing import CONTROLLER_FORMS as CONTROLLER_FORMS
from oed.exports.writing import FORMS as FORMS
from oed.exports.writing import export_trajectory as export_trajectory
from oed.exports.writing import write_form as write_form
