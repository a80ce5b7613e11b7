"""Known payloads at the flange: their inertial parameters, and adding them to a model's parameters."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from robots.base_parameters import BaseParameters, find_base_parameters
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.regressor import TorqueModel
from robots.robot import Robot
from robots.terms.situations.sensitivities import moved_body

FLANGE = "chain.tip"
"""In `Robot.assumed` where the pose of the flange on the last link is not known."""


def with_body(model: TorqueModel, parameters: Array, body: Array) -> Array:
    """Adds a body at the flange to a model's standard parameters.

    Args:
        model: the torque model.
        parameters: its standard parameters (p,).
        body: inertial parameters of the body in the flange's frame (10,); zeros for none.

    Returns:
        The parameters with the body (p,).

    Raises:
        InputError: a body of another shape, a model without links, or a robot whose flange is not known.
    """
    result = np.array(parameters)
    if body.any():
        require_flange(model.robot)
        last = link_columns(model)
        if body.shape != (10,) or not last:
            raise InputError(f"a body of shape {body.shape}", allowed="(10,), on a model with rigid links")
        result[list(last)] += moved_body(model.robot.chain.tip) @ body
    return result


def link_columns(model: TorqueModel, link: int | None = None) -> tuple[int, ...]:
    """Gives the indices of a link's ten columns; none of a model without links.

    Args:
        model: the torque model.
        link: counted from 1; None for the last one.
    """
    rigid = tuple(i for i, column in enumerate(model.columns) if column.term == "rigid_body")
    return rigid[-10:] if link is None else rigid[10 * (link - 1) : 10 * link]


def payload_part(model: TorqueModel, link: int | None = None) -> BaseParameters:
    """Gives what the torques show of a body on a link if all else is known: the parameters of that link.

    A body on a link moves as the link does, so that their ten columns are the same but for the frame.

    Args:
        model: the torque model.
        link: counted from 1; None for the last one, which carries the flange.
    """
    return find_base_parameters(model, columns=link_columns(model, link))


def carrying(robot: Robot, body: ArrayLike | None) -> Robot:
    """Gives the robot with a body on its flange as a part of its last link, the same object for the same body.

    Args:
        robot: the robot; without known inertias it stays as it is.
        body: ten inertial parameters in the flange's frame (10,); None for none.

    Raises:
        InputError: a robot whose flange is not known.
    """
    values = None if body is None else np.asarray(body, dtype=float)
    if values is None or not values.any():
        return robot
    require_flange(robot)
    return _carrying(robot, tuple(values.tolist()))


def require_flange(robot: Robot) -> None:
    """Refuses a robot whose flange is not known, such as that of an older model file.

    Raises:
        InputError: naming the robot.
    """
    if FLANGE in robot.assumed:
        raise InputError(
            f"the model file of {robot.name} does not state the pose of the flange, which a payload refers to",
            remedy="it was written by another version: identify the model again",
        )


@lru_cache(maxsize=16)
def _carrying(robot: Robot, body: tuple[float, ...]) -> Robot:
    inertia = np.array(robot.inertia)
    inertia[-1] += moved_body(robot.chain.tip) @ np.array(body)
    return replace(robot, inertia=inertia)


def point_mass(mass: float, centre: tuple[float, float, float]) -> Array:
    """Returns the inertial parameters (10,) of a point mass [kg] at a point [m] in the flange's frame."""
    x, y, z = centre
    inertia = (y * y + z * z, -x * y, -x * z, x * x + z * z, -y * z, x * x + y * y)
    return mass * np.array([1.0, x, y, z, *inertia])
