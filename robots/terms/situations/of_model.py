"""Rotor inertias and velocity scale of a base model."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from robots.regressor import TorqueModel

Array = NDArray[np.float64]


def rotor_inertias(model: TorqueModel, parameters: Array) -> Array:
    """Gives the rotors' inertias (2, n): as fitted, and as described where the fit holds them within the links'.

    Next to the base, a rotor moves with its link: no log separates them, and one base parameter contains both.

    Args:
        model: the base model.
        parameters: its standard parameters (p,).
    """
    result = np.zeros((2, model.robot.n))
    for column, value in zip(model.columns, parameters, strict=True):
        if column.term == "rotor_inertia":
            at = column.joint - 1
            result[:, at] = (value, 0.0) if value else (0.0, model.robot.rotor_inertia[at])
    return result


def sign_of(dq: Array, v0: float | Array) -> Array:
    """Gives the sign of velocities as a base model takes it: tanh(dq / v0), the sharp sign where v0 is 0."""
    return np.where(v0 > 0, np.tanh(dq / np.where(v0 > 0, v0, 1.0)), np.sign(dq))


def velocity_scale(model: TorqueModel) -> Array:
    """Gives v0 (n,) of a model's sign, tanh(dq / v0); 0 for the sharp sign."""
    scales = [term.velocity_scale for term in model.terms if hasattr(term, "velocity_scale")]
    return np.broadcast_to(np.asarray(scales[0] if scales else 0.0, dtype=float), (model.robot.n,)).copy()
