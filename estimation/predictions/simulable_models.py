"""The model nearest to an identified one that can be simulated: bodies that can exist, and no negative rotors."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimation.exports.feasible import nearest_within_errors
from estimation.linear_algebra.conic import ConicProgram
from estimation.models.model import Model
from estimation.regressions.parameter_priors import link_spreads
from robots.base_parameters import find_base_parameters
from robots.common.errors import InputError
from robots.consistency import BASIS, pseudo_inertia
from robots.geometry.inertia import SIZE
from robots.plants.closed_loop import LEAST_INERTIA

Array = NDArray[np.float64]

MARGIN = 1e-6
"""Smallest eigenvalue of a pseudo-inertia, in units of the link's own mass and reach."""
INERTIAL = ("rigid_body", "rotor_inertia")


def nearest_simulable(model: Model) -> tuple[Model, float]:
    """Moves the inertial base parameters by as little as their covariance allows, until the model can be simulated.

    With the change d of these parameters it minimises ``d' C^-1 d``, C their covariance. Each link keeps a twentieth of
    the described pseudo-inertia, and each rotor of the described inertia. So the inertia matrix keeps a twentieth of
    the described one in every pose. Friction and offsets follow by their covariance with the others.

    Args:
        model: an identified model.

    Returns:
        The model, and the largest change of a determined parameter in standard errors.

    Raises:
        InputError: no description to stay near to, or parameters that are not the robot's base parameters.
        SolverError: the solver gave up.
    """
    robot, torque_model = model.robot, model.torque_model
    described, rotor = np.asarray(robot.inertia), np.asarray(robot.rotor_inertia)
    if not np.isfinite(described).all():
        raise InputError(f"{robot.name}: the robot's description states no inertial parameters to stay near to")
    base = find_base_parameters(torque_model, gravities=model.gravities)
    if base.independent != model.columns:
        raise InputError("the model's parameters are not the robot's base parameters", remedy="identify it again")
    own = np.array([column.term in INERTIAL for column in base.columns])
    rigid, rotors = ([i for i, column in enumerate(torque_model.columns) if column.term == term] for term in INERTIAL)
    joints = np.array([int(torque_model.columns[i].joint or 1) - 1 for i in rotors], dtype=int)
    spread = link_spreads(described)
    # Where no rotor is described, the link that it turns sets the scale.
    rotor_spread = np.where(rotor > 0.0, rotor, spread[:, -1])[joints]
    unit = np.concatenate([spread.reshape(-1), rotor_spread])
    scaled = base.grouping[own][:, [*rigid, *rotors]] * unit

    def constrain(program: ConicProgram) -> None:
        _keep_bodies(program, described, spread)
        if len(joints):
            place = np.arange(SIZE * robot.n, len(unit))
            program.nonnegative(np.eye(program.size)[place], -LEAST_INERTIA * rotor[joints] / rotor_spread)

    start = np.concatenate([(described / spread).reshape(-1), rotor[joints] / rotor_spread])
    return nearest_within_errors(model, own, scaled, model.values[own], start, constrain, "a model that simulates")


def _keep_bodies(program: ConicProgram, described: Array, spread: Array) -> None:
    """Demands that each link keeps a share of its described pseudo-inertia, and is a body that can exist."""
    for link, own in enumerate(described):
        basis = np.zeros((program.size, 4, 4))
        # A congruence by mass and reach makes the units of the matrix one, and keeps its signs.
        scale = np.array([1.0, 1.0, 1.0, spread[link, 1] / spread[link, 0]]) / np.sqrt(spread[link, 4])
        weigh = scale[:, None] * scale
        basis[SIZE * link : SIZE * (link + 1)] = BASIS * spread[link][:, None, None] * weigh
        least = pseudo_inertia(own) * weigh
        if np.linalg.eigvalsh(least)[0] < 0.0:
            least = np.zeros((4, 4))
        program.semidefinite(basis, -LEAST_INERTIA * least - MARGIN * np.eye(4))
