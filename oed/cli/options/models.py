"""Options of the model that is fitted."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from robots.common.errors import InputError
from robots.common.options import Option, Seed

if TYPE_CHECKING:
    from estimation import Model

FRICTIONS = "robots.regressor:FRICTIONS"
"""Where the friction models are listed, for shells."""


@dataclass(frozen=True, kw_only=True)
class Fit:
    """The model that a log is fitted with.

    Attributes:
        friction: friction model: auto (bends within the recorded speeds, grows linearly beyond), polynomial
            (four coefficients a joint) or coulomb-viscous (two).
        seed: seed of the random numbers.
    """

    friction: Annotated[str, Option(choices=FRICTIONS)] = "auto"
    seed: Seed = 0


@dataclass(frozen=True, kw_only=True)
class Planned:
    """The model that an experiment is planned for.

    Attributes:
        friction: friction model: polynomial (four coefficients a joint) or coulomb-viscous (two).
    """

    friction: Annotated[str, Option(choices=FRICTIONS)] = "polynomial"


def model_for(path: Path, joints: int) -> Model:
    """Reads a model of a robot with so many joints.

    Args:
        path: a model.json, or its folder.
        joints: of the robot.

    Raises:
        InputError: see `estimation.load_model`; or a model of another number of joints.
    """
    from estimation import load_model

    model = load_model(path)
    if model.robot.n != joints:
        raise InputError(f"a model of {model.robot.n} joints", file=path, allowed=str(joints))
    return model
