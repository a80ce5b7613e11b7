"""Extensions of a model: effects with their shapes, coefficients and uncertainty."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.plain import finite
from robots.common.records import Record
from robots.robot import Robot
from robots.terms.discrepancies.patterns import build_pattern
from robots.terms.effect_bases.capabilities import AtReversals, Reading
from robots.terms.effect_bases.gear_load import ExtraGearLoad, LoadPath, LoadSource, with_gear_load
from robots.terms.effects import EFFECTS, Effect
from robots.terms.situations.situation import Situation


@dataclass(frozen=True, kw_only=True, eq=False)
class Extension(Record):
    """One effect beside a base model.

    Attributes:
        effect: its name in the catalogue, or the description of a pattern.
        joint: counted from 1; None for the whole robot.
        shape: values of the shape parameters.
        coefficients: values of the linear ones (k,).
        covariance: of coefficients and shape together (k + s, k + s).
    """

    ENTRIES = ("effect", "joint", "shape", "coefficients", "covariance", "parameters")

    effect: str
    joint: int | None
    shape: tuple[float, ...]
    coefficients: Array
    covariance: Array

    @property
    def source(self) -> Effect:
        """The effect.

        Raises:
            InputError: a name that this version does not know.
        """
        return find_effect(self.effect)

    def torque(self, state: Situation) -> Array:
        """Evaluates its torque (N, n) [N m or N]."""
        X = np.nan_to_num(self.source.columns(state, self.joint, self.shape), nan=0.0, posinf=0.0, neginf=0.0)
        return np.asarray(X @ self.coefficients)

    def parameters(self, robot: Robot) -> list[dict[str, Any]]:
        """Lists its parameters with standard errors: the linear ones, then the shape."""
        described = _described(self.source, robot, self.joint, self.shape)
        values = [*self.coefficients.tolist(), *self.shape]
        errors = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        return [
            {"name": name, "unit": unit, "value": float(value), "standard_error": finite(error)}
            for (name, unit), value, error in zip(described, values, errors, strict=True)
            if name
        ]


def read_extension(data: Mapping[str, Any], robot: Robot) -> Extension:
    """Reads what `Extension.to_dict` wrote.

    Raises:
        InputError: an unknown effect, or values that do not fit it.
    """
    effect = find_effect(str(data["effect"]))
    joint = data["joint"]
    if joint not in effect.joints(robot):
        raise InputError(f"extension {effect.name} on joint {joint}", allowed="a joint on which the effect can act")
    shape = tuple(float(value) for value in data["shape"])
    coefficients = np.array(data["coefficients"], dtype=float)
    rows = [[np.inf if value is None else float(value) for value in row] for row in data["covariance"]]
    covariance = np.array(rows, dtype=float).reshape(len(rows), len(rows))
    count = len(effect.parameters(robot, joint))
    names = [str(parameter["name"]) for parameter in data.get("parameters", ())]
    known = [name for name, _ in _described(effect, robot, joint, shape) if name]
    if names and names != known:
        raise InputError(
            f"extension {effect.name} has the parameters {', '.join(names)}",
            allowed=", ".join(known),
            remedy="it was written by another version: diagnose the logs again",
        )
    if len(shape) != len(effect.shapes) or coefficients.shape != (count,) or len(rows) != count + len(shape):
        raise InputError(
            f"extension {effect.name} has {len(coefficients)} coefficients and {len(shape)} shape values",
            allowed=f"{count} and {len(effect.shapes)}",
        )
    if not (np.isfinite(coefficients).all() and np.isfinite(shape).all()):
        raise InputError(f"extension {effect.name} has values that are not finite")
    return Extension(
        effect=str(data["effect"]), joint=joint, shape=shape, coefficients=coefficients, covariance=covariance
    )


def read_gear_load(data: Mapping[str, Any], robot: Robot) -> ExtraGearLoad:
    """Reads what gears bear of the extensions, as `model.json` has it.

    Raises:
        InputError: an unknown way or effect, or values that do not fit it.
    """
    if data["how"] not in get_args(LoadPath):
        raise InputError(f"borne_by_gears: how is {data['how']!r}", allowed=", ".join(get_args(LoadPath)))
    weights = []
    for item in data["weights"]:
        effect, joint = find_effect(str(item["effect"])), item["joint"]
        values = [np.array(item[key], dtype=float) for key in ("shape", "coefficients")]
        if not effect.loads_gear or joint not in effect.joints(robot):
            raise InputError(
                f"borne_by_gears: {effect.name} on joint {joint}", allowed="an effect whose torque loads the gear"
            )
        sizes = (len(effect.shapes),), (len(effect.parameters(robot, joint)),)
        if tuple(v.shape for v in values) != sizes or not all(np.isfinite(v).all() for v in values):
            raise InputError(f"borne_by_gears: values of {effect.name} that do not fit it")
        weights.append(LoadSource(effect, joint, tuple(values[0].tolist()), values[1]))
    return ExtraGearLoad(data["how"], weights)


def find_effect(name: str) -> Effect:
    """Finds an effect of the catalogue, or the pattern that a text describes.

    Raises:
        InputError: neither.
    """
    if name in EFFECTS:
        return EFFECTS[name]
    EFFECTS.refuse_failed(name)
    pattern = build_pattern(name)
    if pattern is None:
        raise InputError(
            f"unknown effect {name!r}",
            allowed=", ".join(EFFECTS),
            remedy="register it, install the package that offers it, or use a newer version of robot-oed",
        )
    return pattern


def extension_torque(
    extensions: Sequence[Extension], felt: Situation, own: Situation | None = None, bearing: ExtraGearLoad | None = None
) -> Array:
    """Evaluates the torque (N, n) [N m or N] of a model's extensions.

    Effects on the total torque come after the others: first delays, then the current limit.

    Args:
        extensions: the effects.
        felt: what they depend on, by the base parameters that they were fitted beside.
        own: the same by the model's own parameters, for what cuts off the torque: it is fitted to all of it; by default
            those are the same.
        bearing: what of them the gears bear; None for nothing.
    """
    total, own = np.zeros_like(felt.q), felt if own is None else own
    felt = with_gear_load(felt, bearing)
    for stage in range(3):
        now = (felt, felt.beside(total), own.beside(total))[stage]
        acting = [extension for extension in extensions if _stage(extension.source) == stage]
        total = total + sum((extension.torque(now) for extension in acting), start=np.zeros_like(total))
    return total


def _stage(effect: Effect) -> int:
    return 2 if effect.reading is Reading.CUTS else int(effect.at_reversals is AtReversals.LATE)


def _described(effect: Effect, robot: Robot, joint: int | None, shape: tuple[float, ...]) -> list[tuple[str, str]]:
    """Lists names and units: the linear parameters, then the shape."""
    linear = [(c.name, c.unit) for c in effect.described(robot, joint, shape)]
    return linear + [(s.name, s.unit_at(robot, joint)) for s in effect.shapes]
