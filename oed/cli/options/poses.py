"""Options of poses for a calibration."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from robots.common.errors import InputError
from robots.common.options import Option, Point, names

if TYPE_CHECKING:
    from oed.experiments.pose_designs import View
    from robots.geometry_errors import Measurement


@dataclass(frozen=True, kw_only=True)
class PoseSet:
    """Poses, and what is measured at them.

    Attributes:
        poses: number of poses.
        measurement: what is measured: markers, markers:N, poses, distances, distances:N or inclinometer.
        kinds: kinds of errors to determine, comma-separated: joint_zero, link_placement, gear_ratio, eccentricity,
            joint_compliance, link_compliance.
        view_from: where the instrument stands, X,Y,Z in the base frame [m].
        view_towards: the point at which it looks, X,Y,Z in the base frame.
        view_cone: half-angle of its cone of view [deg].
        facing: direction of the flange in which markers face, X,Y,Z: they are seen within 60 deg of it.
    """

    poses: Annotated[int, Option(least=1)] = 30
    measurement: str = "markers:3"
    kinds: Annotated[tuple[str, ...], Option(reads=names)] = ("joint_zero", "link_placement")
    view_from: Point = None
    view_towards: Point = None
    view_cone: float = 30.0
    facing: Point = None

    def view(self) -> View | None:
        """Makes what the instrument sees; None for all.

        Raises:
            InputError: a direction of an instrument whose place is not stated.
        """
        from oed.experiments.pose_designs import View

        if self.view_from is None:
            if self.view_towards is not None or self.facing is not None:
                raise InputError(
                    "--view-towards and --facing need --view-from", remedy="state where the instrument stands"
                )
            return None
        cone = math.radians(self.view_cone)
        return View(origin=self.view_from, towards=self.view_towards, cone=cone, axis=self.facing)

    def instrument(self) -> Measurement:
        """Makes the measurement.

        Raises:
            InputError: another name, or a number that is none.
        """
        from robots.geometry_errors import measurement_of

        return measurement_of("--measurement", self.measurement)

    def noise_levels(self, noise: Sequence[float] | None) -> dict[str, float]:
        """Gives the noise of the measurement's units.

        Args:
            noise: one number per unit.

        Raises:
            InputError: more numbers than units.
        """
        units = list(dict.fromkeys(self.instrument().units))
        if noise is not None and len(noise) > len(units):
            raise InputError(f"--noise with {len(noise)} numbers", allowed=f"one per unit: {', '.join(units)}")
        return dict(zip(units, noise or (), strict=False))
