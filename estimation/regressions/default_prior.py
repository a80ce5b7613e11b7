"""The prior of every fit: a plausible arm, its friction and its drives, as far as nothing is known of them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from estimation.regressions.moments import Moments
from estimation.regressions.parameter_priors import (
    SILENT_COLUMN,
    GaussianPrior,
    inflate_conflicting_prior,
    link_spreads,
    prior_of_spreads,
)
from estimation.regressions.standard_parameters import mass_from_torque, reference_bodies
from robots.base_parameters import BaseParameters
from robots.common.arrays import Array
from robots.regressor import TorqueModel
from robots.terms import PositionTorque
from robots.terms.rigid_body import SYMBOLS

# What a model lacks is alike for about so long [s] of a motion: rows closer than that do not inform twice.
MODEL_ERROR_MEMORY = 0.1


def default_prior(base: BaseParameters, spread: Array, level: Array) -> GaussianPrior:
    """Builds the prior: each parameter scatters about the description by its own size, or about zero without one.

    Links scatter by their mass, mass times reach and mass times reach squared (`link_spreads`); a link without
    description is as heavy as the torques suggest. What belongs to a joint scatters by the parameter that makes a usual
    share of the joint's torque.

    Args:
        base: base parameters.
        spread: standard deviation of each joint's torque (n,) [N m or N].
        level: RMS of each standard column on the joint of its own (p,).
    """
    model = base.model
    # Torque of a joint without torque, as a share of the largest joint's.
    torque = np.maximum(spread, max(1e-3 * float(spread.max()), np.finfo(float).tiny))
    bodies, _ = reference_bodies(model.robot, mass_from_torque(model.robot, float(torque.max())))
    links = link_spreads(bodies)
    scatter = joint_scatter(model, torque, level)
    for i, column in enumerate(model.columns):
        if column.term == "rigid_body":
            scatter[i] = links[column.joint - 1, SYMBOLS.index(column.symbol)]
    return prior_of_spreads(base, scatter, np.nan_to_num(model.nominal))


def joint_scatter(model: TorqueModel, spread: Array, level: Array) -> Array:
    """Gives how far friction, rotor, offset and other parameters of the joints scatter (p,), zero for bodies.

    Args:
        model: the torque model with p standard parameters.
        spread: standard deviation of each joint's torque (n,) [N m or N].
        level: RMS of each column on the joint of its own (p,).
    """
    scatter = np.zeros(model.size)
    for i, column in enumerate(model.columns):
        if column.term != "rigid_body":
            # Torque that friction, rotor or offset of a joint usually makes, and that an unknown function of its
            # position does, as shares of the torque's standard deviation. `benchmarks/transfer.py` is flat about both:
            # half and twice the value change the median error by 3 %.
            share = 0.07 if column.term == PositionTorque.name else 0.2
            # A column that never acts stays at its description by any spread.
            scatter[i] = share * spread[column.joint - 1] / (level[i] if level[i] > SILENT_COLUMN else 1.0)
    return scatter


def weighed_prior(
    solve: Callable[[Moments, float], tuple[Array, Array]], moments: Moments, prior: GaussianPrior, rows: float
) -> tuple[float, GaussianPrior]:
    """Weighs a prior against the residual of the data, and weakens it where the data contradict it.

    Args:
        solve: (moments, ridge) -> parameters (p,) and weights (n,).
        moments: of the data.
        prior: of the parameters (p,).
        rows: how many rows inform as much as one that is independent of all others.

    Returns:
        The ridge by which the prior counts for what it is, see `Moments.solve`, and the weakened prior.
    """
    # Contradictions show against the noise that the data alone leave: beside a wrong prior all of it would be noise.
    # Weight of a prior that hardly counts.
    hardly = 1e-6
    precision = moments.level(solve(moments.pulled(prior), hardly)[0]) ** -2
    information = np.tensordot(precision, moments.gram, axes=1) / rows
    # Standard deviations of the prior from which the data are said to contradict it.
    held = inflate_conflicting_prior(prior, information, precision @ moments.cross / rows, sigmas=4.0)
    ridge = hardly
    # The weight and the residual adapt to each other.
    for _ in range(2):
        precision = moments.level(solve(moments.pulled(held), ridge)[0]) ** -2
        ridge = rows / max(float(precision @ moments.square), np.finfo(float).tiny)
    return ridge, held
