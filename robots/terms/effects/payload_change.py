"""A payload that is gripped, dropped or exchanged."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from robots.terms.effect_bases.base import Coefficient, Effect, Place, Shape, Situation
from robots.terms.effect_bases.states import change_times

if TYPE_CHECKING:
    from robots.robot import Robot

Array = NDArray[np.float64]


class PayloadChange(Effect):
    """tau = Y_tool (m, m c, Ixx, Iyy, Izz) from the time t_c on: a body on the flange, in its frame.

    Its products of inertia are left out: a tool's are small against what its distance makes of the others. Where
    `own_inertia` is 0, so are its moments of inertia: a small body's hardly show.
    """

    name: ClassVar[str] = "payload_change"
    title: ClassVar[str] = "sudden change of the payload"
    loads_gear: ClassVar[bool] = True
    whole_robot: ClassVar[bool] = True
    depends_on: ClassVar[Literal["state", "time"]] = "time"
    shapes: ClassVar[tuple[Shape, ...]] = (
        Shape("change_time", "s", -np.inf, np.inf, "linear", inexact=0.03),
        Shape("own_inertia", "", 0.0, 1.0, "linear", default=1.0),
    )
    rivals: ClassVar[tuple[str, ...]] = ("torque_sensor_drift", "external_contact", "friction_step", "base_tilt")
    experiments: ClassVar[tuple[str, ...]] = ("static_hold", "repeat")

    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the change of mass, of first moments and of moments of inertia, in the flange's frame."""
        return (
            Coefficient("mass_change", "kg"),
            *(Coefficient(f"moment_change_{axis}", "kg m") for axis in "xyz"),
            *(Coefficient(f"inertia_change_{axis}", "kg m2") for axis in "xyz"),
        )

    def grid(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists times through the data, and the pauses between logs."""
        return tuple((time, 0.0) for time in change_times(situation))

    def bounds(self, situation: Situation, joint: Place) -> tuple[tuple[float, float], ...]:
        """Keeps the change within the data, and leaves moments of inertia to `likely`."""
        return (float(situation.t[0]), float(situation.t[-1])), (0.0, 0.0)

    def likely(
        self, situation: Situation, joint: Place, shape: tuple[float, ...], coefficients: Array
    ) -> tuple[tuple[float | None, ...], ...]:
        """Gives a body with moments of inertia of its own."""
        return ((None, 1.0),)

    def columns(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the torque of all joints per kg, kg m and kg m2."""
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
"""Used inertial parameters: all but the products of inertia."""
