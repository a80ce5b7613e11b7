"""Checks of effects that were written outside this package, made before they are used."""

from __future__ import annotations

import numpy as np

from robots.common.errors import InputError
from robots.common.registry import name_of, subclass_check
from robots.regressor import default_model
from robots.robot import Robot
from robots.terms.effect_bases.base import Effect
from robots.terms.effect_bases.experiments import EXPERIMENTS
from robots.terms.situations.situation import situation

_complete = subclass_check(Effect)


def check_definition(effect: object) -> None:
    """Checks that an object is an effect or an effect class, with a name, a title and known experiments.

    Args:
        effect: the object to check.

    Raises:
        InputError: something is missing or unknown; the message names it.
    """
    kind = effect if isinstance(effect, type) else type(effect)
    _complete(kind)
    name = name_of(effect)
    if not isinstance(getattr(kind, "title", None), str):
        raise InputError(f"the effect {name!r} has no title", allowed="a class attribute `title`, a string")
    unknown = [kind_ for kind_ in getattr(kind, "experiments", ()) if kind_ not in EXPERIMENTS]
    if unknown:
        raise InputError(f"the effect {name!r} names the experiment {unknown[0]!r}", allowed=", ".join(EXPERIMENTS))


def check_effect(effect: Effect, robot: Robot) -> None:
    """Checks an effect's parameters and columns on a short motion of a robot.

    Args:
        effect: the effect to check, at the first joint where it can act.
        robot: the robot.

    Raises:
        InputError: a parameter has no name or unit, the columns have a wrong shape or are not finite, or the effect's
            own code raises. The message names the effect.
    """
    try:
        _check(effect, robot)
    except InputError:
        raise
    except Exception as error:
        raise InputError(f"the effect {effect.name!r} fails: {type(error).__name__}: {error}") from error


def _check(effect: Effect, robot: Robot) -> None:
    places = effect.joints(robot)
    if not places:
        return
    joint = places[0]
    described = effect.parameters(robot, joint)
    for parameter in [*((c.name, c.unit) for c in described), *((s.name, s.unit) for s in effect.shapes)]:
        if not all(parameter):
            raise InputError(
                f"the effect {effect.name!r} has a parameter {parameter[0]!r} without a unit",
                allowed="a name and a unit each; the unit 1 for a pure number",
            )
    count = 200
    t = 0.01 * np.arange(count)
    phase = 2 * np.pi * (0.5 * t[:, None] + np.arange(robot.n) / robot.n)
    model = default_model(robot, velocity_scale=0.01)
    values = np.where(np.isfinite(model.nominal), model.nominal, 0.1)
    # Small motions about zero suffice, because only array shapes and finiteness are checked.
    state = situation(model, values, t, 0.1 * np.sin(phase), 0.3 * np.cos(phase), -np.sin(phase))
    for shape in effect.grid(state, joint)[:1]:
        columns = np.asarray(effect.columns(state, joint, shape))
        expected = (count, robot.n, len(described))
        if columns.shape != expected:
            raise InputError(
                f"the effect {effect.name!r} gives columns of shape {columns.shape}",
                allowed=f"{expected}: samples, joints, parameters",
            )
        if not np.isfinite(columns).all():
            raise InputError(f"the effect {effect.name!r} gives columns that are not finite")
