"""The torque model that an identification fits, before and after the data have chosen its settings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimation.identifications.choices import VELOCITY_SCALES, Choice
from robots.base_parameters import BaseParameters, find_base_parameters
from robots.common.errors import InputError
from robots.regressor import TorqueModel, default_model
from robots.robot import Robot
from robots.terms import FrictionTerm, PositionTorque


@dataclass(frozen=True)
class ModelForm:
    """What a user sets of the model.

    Attributes:
        robot: the robot.
        friction: a name, or a term.
        rotor: with rotor inertias.
        offset: with a torque offset per joint.
        gravities: (3,) each, of logs under another gravity than the described one [m/s2].
    """

    robot: Robot
    friction: str | FrictionTerm
    rotor: bool
    offset: bool
    gravities: Sequence[NDArray[np.float64]]

    def first(self, position: bool) -> BaseParameters:
        """Base parameters with the first scale of the friction's sign.

        Args:
            position: whether each joint has a torque by its position.

        Raises:
            InputError: an unknown friction.
        """
        try:
            model = self._model(VELOCITY_SCALES[0], position)
        except InputError as error:
            raise InputError(error.problem, allowed=error.allowed and f"auto, {error.allowed}") from error
        return find_base_parameters(model, gravities=self.gravities)

    def chosen(self, base: BaseParameters, choice: Choice, position: bool) -> BaseParameters:
        """The base parameters for what the data chose.

        Args:
            base: the first ones.
            choice: of the data.
            position: whether the first ones have a torque by position.
        """
        if choice.position != position:
            base = self.first(False)
        if set(choice.velocity_scales) != {VELOCITY_SCALES[0]}:
            base = replace(base, model=self._model(choice.velocity_scales, choice.position))
        return base

    def _model(self, scales: float | tuple[float, ...], position: bool) -> TorqueModel:
        plain = default_model(
            self.robot, friction=self.friction, velocity_scale=scales, rotor=self.rotor, offset=self.offset
        )
        return replace(plain, terms=(*plain.terms, PositionTorque())) if position else plain
