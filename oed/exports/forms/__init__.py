"""Forms in which a trajectory goes to a controller or a simulator, one file each."""

from __future__ import annotations

from oed.exports.forms.abb import Abb, AbbEgm
from oed.exports.forms.base import ExportOptions, Form
from oed.exports.forms.franka import Franka, FrankaPlayer
from oed.exports.forms.kuka import Kuka
from oed.exports.forms.moveit_limits import MoveItLimits
from oed.exports.forms.ros import Ros, RosGoal
from oed.exports.forms.rosbag import Mcap, Rosbag
from oed.exports.forms.simple_message import SimpleMessageReplay
from oed.exports.forms.urscript import UrScript

FORMS: dict[str, Form] = {
    form.name: form
    for form in (
        Ros(),
        RosGoal(),
        Rosbag(),
        Mcap(),
        MoveItLimits(),
        SimpleMessageReplay(),
        UrScript(),
        Kuka(),
        Abb(),
        AbbEgm(),
        Franka(),
        FrankaPlayer(),
    )
}
"""All forms but the trajectory file itself, by name."""

__all__ = ["FORMS", "ExportOptions", "Form"]
