"""A body that is picked up, dropped or exchanged at one time: on the flange, or on a link before it."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from robots.common.arrays import Array
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


LINK = 2  # index of that shape parameter
FEWER = 12
"""Number of change times in a scan of each link: the refinement moves them."""


class PayloadChange(Effect):
    """tau = Y_k (m, m c, I) from the time t_c on: a body on the flange (k = 0) or on link k, in the frame of that.

    It is a body that can exist, picked up or put down: its pseudo-inertia is positive semidefinite, or negative.
    Without moments of inertia of its own (`own_inertia` 0) it is a point mass, because those of a small body hardly
    show. The link counts as a fitted parameter, so that a body that fits on the flange as well is on the flange.
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
        Shape("link", "", 0.0, np.inf, "linear", default=0.0, beside=True),
    )
    rivals: ClassVar[tuple[str, ...]] = ("torque_sensor_drift", "external_contact", "friction_step", "base_tilt")
    experiments: ClassVar[tuple[str, ...]] = ("static_hold", "repeat")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the changes of mass, first moments and inertias in the frame of flange or link."""
        return (
            Coefficient("mass_change", "kg"),
            *(Coefficient(f"moment_change_{axis}", "kg m") for axis in "xyz"),
            *(Coefficient(f"inertia_change_{axes}", "kg m2") for axes in ("x", "xy", "xz", "y", "yz", "z")),
        )

    def grid(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists candidate times within the data, and the start of each further log, on the flange and on the links."""
        flange = tuple((time, 0.0, 0.0) for time in change_times(situation))
        times = change_times(situation, FEWER)
        links = self.choices(situation.robot, LINK)[1:]
        return (*flange, *((time, 0.0, link) for link in links for time in times))

    def choices(self, robot: Robot, k: int) -> tuple[float, ...]:
        """Lists the flange (0) and the links before the last one, whose bodies move as those on the flange do."""
        return tuple(float(link) for link in range(robot.n)) if k == LINK else super().choices(robot, k)

    def bounds(self, situation: Situation, joint: Place) -> tuple[tuple[float, float], ...]:
        """Bounds the change time to the data; `likely` decides on the moments of inertia and the link."""
        return (float(situation.t[0]), float(situation.t[-1])), (0.0, 0.0), (0.0, 0.0)

    def likely(
        self, situation: Situation, joint: Place, shape: tuple[float, ...], coefficients: Array
    ) -> tuple[tuple[float | None, ...], ...]:
        """Lists a body with its own moments of inertia, and the same kind of body on the flange and on other links."""
        here = float(carrier(shape))
        others = (link for link in self.choices(situation.robot, LINK) if link != here)
        return ((None, 1.0, here), *((None, shape[1], link) for link in others))

    def columns(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the torque of all joints per kg, kg m and kg m2 (N, n, 10)."""
        link = carrier(shape)
        body = situation.cached(("columns of a body", link), lambda: _columns(situation, link))
        return body * (situation.t >= shape[0]).astype(float)[:, None, None]

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
        what = f"mass on link {carrier(shape)}" if carrier(shape) else "payload"
        return f"The {what} {change} by {abs(coefficients[0]):.3g} kg at t = {shape[0]:.2f} s."


def carrier(shape: tuple[float, ...]) -> int:
    """The link that carries the body, from 1; 0 for the flange."""
    return round(shape[LINK]) if len(shape) > LINK else 0


def _columns(situation: Situation, link: int) -> Array:
    """The torque of all joints per inertial parameter of a body (N, n, 10) on a link; 0 for the flange."""
    if not link:
        columns = situation.sensitivity("tool")
    else:
        columns = situation.sensitivity("bodies")[:, :, 10 * (link - 1) : 10 * link]
    # Each column is contiguous in memory: filters read one column at a time.
    return np.asfortranarray(columns)
