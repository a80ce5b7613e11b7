"""Backlash: the motor turns freely between two elastic flanks before it drives the link."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi

from robots.drives.base import DriveParameter, Values
from robots.drives.elastic_gear import ElasticGear
from robots.terms.effects import Backlash as BacklashEffect


@dataclass(frozen=True)
class Backlash(ElasticGear):
    """An elastic gear whose spring is slack within +-backlash / 2 of the twist.

    The damping acts in the gap, too, as grease does. Without it a link between the flanks would never rest.
    """

    name: ClassVar[str] = BacklashEffect.name
    title: ClassVar[str] = BacklashEffect.title

    def parameters(self) -> tuple[DriveParameter, ...]:
        """Describes the width of the gap beside stiffness and damping."""
        gap = DriveParameter(name="backlash", unit="rad", upper=0.2, size=5e-3)
        return (*super().parameters(), gap)

    def stretch(self, twist: casadi.SX, values: Values) -> casadi.SX:
        """Builds what the flank takes."""
        half = values["backlash"] / 2
        return twist - casadi.fmax(casadi.fmin(twist, half), -half)

    def twist(self, load: casadi.SX, values: Values) -> casadi.SX:
        """Builds the twist at rest: on the flank to which the load pushes."""
        return super().twist(load, values) + casadi.sign(load) * values["backlash"] / 2
