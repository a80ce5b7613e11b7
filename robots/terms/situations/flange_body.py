"""Known payloads at the flange: their inertial parameters, and adding them to a model's parameters."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robots.common.errors import InputError
from robots.regressor import TorqueModel
from robots.terms.situations.sensitivities import moved_body

Array = NDArray[np.float64]


def with_body(model: TorqueModel, parameters: Array, body: Array) -> Array:
    """Adds a body at the flange to a model's standard parameters.

    Args:
        model: the torque model.
        parameters: its standard parameters (p,).
        body: inertial parameters of the body in the flange's frame (10,); zeros for none.

    Returns:
        The parameters with the body (p,).

    Raises:
        InputError: a body of another shape, or a model without links.
    """
    result = np.array(parameters)
    if body.any():
        last = [i for i, column in enumerate(model.columns) if column.term == "rigid_body"][-10:]
        if body.shape != (10,) or not last:
            raise InputError(f"a body of shape {body.shape}", allowed="(10,), on a model with rigid links")
        result[last] += moved_body(model.robot.chain.tip) @ body
    return result


def point_mass(mass: float, centre: tuple[float, float, float]) -> Array:
    """Returns the inertial parameters (10,) of a point mass [kg] at a point [m] in the flange's frame."""
    x, y, z = centre
    inertia = (y * y + z * z, -x * y, -x * z, x * x + z * z, -y * z, x * x + y * y)
    return mass * np.array([1.0, x, y, z, *inertia])
