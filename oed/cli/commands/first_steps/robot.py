"""Shows a robot's chain, limits and masses, and what is assumed of it."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Annotated

from oed.cli.options.robots import Chain
from oed.cli.verbs import Printed, Verb
from robots.common.errors import AssumedValueWarning, InputError
from robots.common.options import Option
from robots.common.progress import Progress


@dataclass(frozen=True, kw_only=True)
class Robot(Verb):
    """``oed robot``.

    Attributes:
        action: what to do: show.
        file: the robot: a catalogue name (er3a, ur10, panda), a URDF or xacro, an MJCF (MuJoCo), or a robot YAML.
        assume_masses: for a description without masses: assume those of a usual arm of its size and this rated payload
            [kg]. All results say so.
    """

    function = "robots.load_robot"
    examples = ("oed robot show ur10", "oed robot show arm.urdf --tip tool0 --json")

    action: Annotated[str, Option(argument=True)]
    file: Annotated[str, Option(argument=True)]
    chain: Chain = Chain()
    assume_masses: Annotated[float | None, Option(shown="KG", section="Robot")] = None

    def run(self, progress: Progress) -> Printed:
        """Describes the robot."""
        from robots.robot_summary import robot_data, robot_summary

        if self.action != "show":
            raise InputError(f"oed robot {self.action}", allowed="show", remedy="oed robot show FILE")
        with warnings.catch_warnings():
            # The summary has them.
            warnings.simplefilter("ignore", AssumedValueWarning)
            described = self.chain.load(self.file, assume_masses=self.assume_masses)
        return Printed(summary=robot_summary(described), data=robot_data(described))
