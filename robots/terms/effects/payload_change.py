"""A payload that is picked up, dropped or exchanged at one time."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from robots.terms.effect_bases.base import Coefficient, Effect, Place, Shape, Situation
from robots.terms.effect_bases.capabilities import GearLoad, Persistence
from robots.terms.effect_bases.carried_bodies import (
    nearest_body,
    nearest_point_mass,
    point_mass_rows,
    point_mass_tangent,
)
from robots.terms.effect_bases.states import change_times

if TYPE_CHECKING:
    from robots.robot import Robot

Array = NDArray[np.float64]


class PayloadChange(Effect):
    """tau = Y_tool (m, m c, I) from the time t_c on: a body at the flange, in the flange's frame.

    It is a body that can exist, picked up or put down: its pseudo-inertia is positive semidefinite, or negative.
    Without moments of inertia of its own (`own_inertia` 0) it is a point mass, because those of a small body hardly
    show.
    """

    name: ClassVar[str] = "payload_change"
    title: ClassVar[str] = "sudden change of the payload"
    persistence: ClassVar[Persistence] = Persistence.TIME
    gear_load: ClassVar[GearLoad] = GearLoad.CAUSES
    whole_robot: ClassVar[bool] = True
    constrained: ClassVar[bool] = True
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("change_time", "s", -np.inf, np.inf, "linear", inexact=0.03),
        Shape("own_inertia", "", 0.0, 1.0, "linear", default=1.0),
    )
    rivals: ClassVar[tuple[str, ...]] = ("torque_sensor_drift", "external_contact", "friction_step", "base_tilt")
    experiments: ClassVar[tuple[str, ...]] = ("static_hold", "repeat")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the changes of mass, first moments and inertias in the flange's frame."""
        return (
            Coefficient("mass_change", "kg"),
            *(Coefficient(f"moment_change_{axis}", "kg m") for axis in "xyz"),
            *(Coefficient(f"inertia_change_{axes}", "kg m2") for axes in ("x", "xy", "xz", "y", "yz", "z")),
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
        """Evaluates the torque of all joints per kg, kg m and kg m2 (N, n, 10)."""
        # Each column is contiguous in memory: filters read one column at a time.
        tool = situation.cached("columns of the tool", lambda: np.asfortranarray(situation.sensitivity("tool")))
        return tool * (situation.t >= shape[0]).astype(float)[:, None, None]

    def nearest(self, matrix: Array, target: Array, shape: tuple[float, ...]) -> Array:
        """Finds the best body, or point mass, that was picked up or put down."""
        return nearest_body(matrix, target) if shape[1] else nearest_point_mass(matrix, target)

    def tangent(self, coefficients: Array, shape: tuple[float, ...]) -> Array | None:
        """Gives the directions in which a point mass may vary; a body may vary in all."""
        return None if shape[1] or not coefficients[0] else point_mass_tangent(coefficients)

    def form_rows(self, coefficients: Array, shape: tuple[float, ...]) -> Array:
        """Gives the rows by which a body that was fitted as a point mass may have moments of inertia of its own."""
        if shape[1] or not coefficients[0]:
            return np.zeros((0, len(coefficients)))
        return point_mass_rows(coefficients)

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
