"""Rotor inertias and velocity scale of a base model."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from robots.common.arrays import Array

if TYPE_CHECKING:
    from robots.regressor import TorqueModel


def rotor_inertias(model: TorqueModel, parameters: Array) -> Array:
    """Returns the rotor inertias of a base model: fitted ones, and described ones that are not fitted.

    No log separates the first joints' rotor inertia from their link inertia. One base parameter contains both, so the
    rotor's own parameter is zero, and its described value is given instead.

    Args:
        model: the base model.
        parameters: its standard parameters (p,).

    Returns:
        (2, n) [kg m2 or kg]: fitted inertias, and described inertias of rotors whose parameter is zero; zero elsewhere.
    """
    result = np.zeros((2, model.robot.n))
    for column, value in zip(model.columns, parameters, strict=True):
        if column.term == "rotor_inertia":
            at = column.joint - 1
            result[:, at] = (value, 0.0) if value else (0.0, model.robot.rotor_inertia[at])
    return result


def sign_of(dq: Array, v0: float | Array) -> Array:
    """Evaluates the base model's sign of velocities: tanh(dq / v0), or the sharp sign where v0 is 0."""
    return np.where(v0 > 0, np.tanh(dq / np.where(v0 > 0, v0, 1.0)), np.sign(dq))


def velocity_scale(model: TorqueModel) -> Array:
    """Returns v0 (n,) [rad/s or m/s] of a model's sign, tanh(dq / v0); 0 for the sharp sign."""
    scales = [term.velocity_scale for term in model.terms if hasattr(term, "velocity_scale")]
    return np.broadcast_to(np.asarray(scales[0] if scales else 0.0, dtype=float), (model.robot.n,)).copy()
