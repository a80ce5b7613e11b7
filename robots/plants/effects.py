"""Effects of a virtual robot beyond its model: an effect of the catalogue with its true size and shape."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from typing import TYPE_CHECKING

import casadi
import numpy as np

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.robot import Robot
from robots.terms.effects import EFFECTS, Effect, Situation, StaticEffect
from robots.terms.situations.of_model import rotor_inertias

if TYPE_CHECKING:
    from robots.regressor import TorqueModel


@dataclass(frozen=True, kw_only=True)
class PlantEffect:
    """One effect that a plant has.

    Attributes:
        effect: its name in `EFFECTS`.
        joint: where it acts, counted from 1; None for the whole robot.
        coefficients: of its columns (k,).
        shape: its shape parameters.
    """

    effect: str
    joint: int | None
    coefficients: tuple[float, ...]
    shape: tuple[float, ...]

    @property
    def term(self) -> Effect:
        """The effect's physics."""
        return EFFECTS[self.effect]

    @property
    def label(self) -> str:
        """Effect and joint, for messages."""
        return self.effect if self.joint is None else f"{self.effect} of joint {self.joint}"

    @property
    def static(self) -> bool:
        """Whether its torque follows from position, velocity and acceleration of the instant alone."""
        return isinstance(EFFECTS.get(self.effect), StaticEffect)

    def expression(
        self,
        model: TorqueModel,
        parameters: Array,
        q: casadi.SX,
        dq: casadi.SX,
        ddq: casadi.SX,
        *,
        gear_load: casadi.SX | None = None,
    ) -> casadi.SX:
        """Builds the torque (n,) of a static effect beside a model, symbolic.

        Args:
            model: the base model.
            parameters: its values (p,).
            q: positions (n,).
            dq: velocities (n,).
            ddq: accelerations (n,).
            gear_load: torque of other effects (n,) that the gears bear; None for none.

        Raises:
            InputError: an effect that depends on the past.
        """
        term = self.term
        if not isinstance(term, StaticEffect):
            raise InputError(
                f"{self.label} depends on the motion's history", allowed="an effect of position, velocity, acceleration"
            )
        Y = model.symbolic()(q, dq, ddq)
        pi = np.asarray(parameters, dtype=float)
        inert = np.array([column.term in ("rigid_body", "rotor_inertia") for column in model.columns])
        widths = [term.velocity_scale for term in model.terms if hasattr(term, "velocity_scale")]
        width = np.broadcast_to(np.asarray(widths[0] if widths else 0.0, dtype=float), (model.robot.n,))
        rigid = Y @ casadi.SX(np.where(inert, pi, 0.0))
        load = rigid - ddq * casadi.SX(rotor_inertias(model, pi).sum(axis=0))
        load = load if gear_load is None else load + gear_load
        at = [q, dq, ddq, rigid, load, Y @ casadi.SX(pi)]
        # Width [rad/s or m/s] of a sign that is stated as sharp: a limit that is watched by its derivatives needs one.
        at += [casadi.tanh(dq / casadi.SX(np.where(width > 0, width, 1e-3))), casadi.SX(list(self.shape))]
        return term.function(model.robot, self.joint)(*at) @ casadi.SX(list(self.coefficients))

    def torque(self, situation: Situation) -> Array:
        """Evaluates what the effect adds to the torque (N, n) [N m or N]."""
        return self.term.columns(situation, self.joint, self.shape) @ np.asarray(self.coefficients)


def plant_effect(robot: Robot, effect: str, joint: int | None, values: Mapping[str, float]) -> PlantEffect:
    """Checks an effect and its values by name.

    Args:
        robot: the robot.
        effect: a name of `EFFECTS`.
        joint: counted from 1; None for an effect of the whole robot.
        values: coefficients and shape parameters by name. All shape parameters without a default must be there; a
            coefficient that is not is zero.

    Raises:
        InputError: an unknown effect or parameter, a joint where the effect cannot act, a value out of range, a
            missing shape parameter, or no coefficient.
    """
    if effect not in EFFECTS:
        near = get_close_matches(effect, EFFECTS, n=3) or list(EFFECTS)
        raise InputError(f"unknown effect {effect!r}", column="effects", allowed=f"such as {', '.join(near)}")
    term = EFFECTS[effect]
    places = term.joints(robot)
    if joint not in places:
        allowed = (
            "no joint, because the effect acts on the whole robot"
            if term.whole_robot
            else ", ".join(str(place) for place in places)
        )
        raise InputError(f"{effect} on joint {joint}", column="effects", allowed=allowed or "a joint of this robot")
    coefficients = term.parameters(robot, joint)
    names = [c.name for c in coefficients] + [s.name for s in term.shapes]
    for name, value in values.items():
        if name not in names:
            raise InputError(f"{effect} has no parameter {name!r}", column="effects", allowed=", ".join(names))
        if not np.isfinite(value):
            raise InputError(f"{effect}: {name} is {value}", column="effects", allowed="a finite number")
    if not any(c.name in values for c in coefficients):
        raise InputError(
            f"{effect} needs at least one nonzero coefficient",
            column="effects",
            allowed=f"one of {', '.join(c.name for c in coefficients)}",
        )
    ranges = [(c.name, c.unit, c.lower, c.upper) for c in coefficients]
    ranges += [(s.name, s.unit, s.lower, s.upper) for s in term.shapes]
    for name, unit, lower, upper in ranges:
        if name in values and not lower <= values[name] <= upper:
            raise InputError(
                f"{effect}: {name} is {values[name]} {unit}", column="effects", allowed=f"{lower:g} to {upper:g}"
            )
    missing = [shape.name for shape in term.shapes if shape.name not in values and shape.default is None]
    if missing:
        raise InputError(f"{effect} lacks {missing[0]}", column="effects", remedy=f"state {', '.join(missing)}")
    return PlantEffect(
        effect=effect,
        joint=joint,
        coefficients=tuple(float(values.get(c.name, 0.0)) for c in coefficients),
        shape=tuple(float(values.get(s.name, s.default or 0.0)) for s in term.shapes),
    )
