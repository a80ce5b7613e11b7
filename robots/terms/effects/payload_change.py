"""A payload that is picked up, dropped or exchanged at one time."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from robots.terms.effect_bases.base import Coefficient, Effect, Place, Shape, Situation
from robots.terms.effect_bases.capabilities import GearLoad, Persistence
from robots.terms.effect_bases.states import change_times

if TYPE_CHECKING:
    from robots.robot import Robot

Array = NDArray[np.float64]


class PayloadChange(Effect):
    """tau = Y_tool (m, m c, Ixx, Iyy, Izz) from the time t_c on: a body at the flange, in the flange's frame.

    The products of inertia are left out, because those of usual tools are comparatively small. The moments of inertia
    are used only if `own_inertia` is 1, because those of a small body hardly show.
    """

    name: ClassVar[str] = "payload_change"
    title: ClassVar[str] = "sudden change of the payload"
    persistence: ClassVar[Persistence] = Persistence.TIME
    gear_load: ClassVar[GearLoad] = GearLoad.CAUSES
    whole_robot: ClassVar[bool] = True
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("change_time", "s", -np.inf, np.inf, "linear", inexact=0.03),
        Shape("own_inertia", "", 0.0, 1.0, "linear", default=1.0),
    )
    rivals: ClassVar[tuple[str, ...]] = ("torque_sensor_drift", "external_contact", "friction_step", "base_tilt")
    experiments: ClassVar[tuple[str, ...]] = ("static_hold", "repeat")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the changes of mass, first moments and moments of inertia in the flange's frame."""
        return (
            Coefficient("mass_change", "kg"),
            *(Coefficient(f"moment_change_{axis}", "kg m") for axis in "xyz"),
            *(Coefficient(f"inertia_change_{axis}", "kg m2") for axis in "xyz"),
        )

    def grid(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists candidate times within the data, and the start of each further log."""
        return tuple((time, 0.0) for time in change_times(situation))

    def bounds(self, situation: Situation, joint: Place) -> tuple[tuple[float, float], ...]:
        """Bounds the change time to the data; `likely` decides on the moments of inertia."""
        return (float(situation.t[0]), float(situation.t[-1])), (0.0, 0.0)

    def likely(
        self, situation: Situation, joint: Place, shape: tuple[float, ...], coefficients: Array
    ) -> tuple[tuple[float | None, ...], ...]:
        """Lists a body with its own moments of inertia."""
        return ((None, 1.0),)

    def columns(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the torque of all joints per kg, kg m and kg m2 (N, n, 7)."""
        X = situation.sensitivity("tool")[:, :, USED] * (situation.t >= shape[0]).astype(float)[:, None, None]
        if not shape[1]:
            X[:, :, 4:] = 0.0
        return X

    def describe(
        self,
        joint: Place,
        coefficients: Array,
        shape: tuple[float, ...] = (),
        *,
        force: str = "N m",
        length: str = "rad",
    ) -> str:
        """Describes the values in one sentence."""
        change = "increased" if coefficients[0] > 0 else "decreased"
        return f"The payload {change} by {abs(coefficients[0]):.3g} kg at t = {shape[0]:.2f} s."


USED = (0, 1, 2, 3, 4, 7, 9)
"""Indices of the inertial parameters used: all but the products of inertia."""
