"""Priors of the parameters: their expected distance from the robot's description."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from estimation.linear_algebra.scaled import LEAST_RIDGE, lengths
from robots.base_parameters import BaseParameters
from robots.common.arrays import Array
from robots.terms import Column
from robots.terms.rigid_body import SYMBOLS

# Friction, rotor and offset of a joint may make so many times its torque: descriptions rarely state them.
OWN_TORQUE_RATIO = 3.0
# A column below this RMS does not act.
SILENT_COLUMN = 1e-9


@dataclass(frozen=True)
class GaussianPrior:
    """A quadratic penalty (pi - target)' precision (pi - target), 1 where a parameter is wrong by its own size.

    Attributes:
        precision: (p, p).
        target: (p,).
    """

    precision: Array
    target: Array

    def times(self, factor: float) -> GaussianPrior:
        """Gives the same prior with a precision of so many times."""
        return GaussianPrior(factor * self.precision, self.target)

    def columns(self, chosen: NDArray[np.intp]) -> GaussianPrior:
        """Keeps some of the p columns, of independent parameters."""
        return GaussianPrior(self.precision[np.ix_(chosen, chosen)], self.target[chosen])


def prior_from_description(base: BaseParameters, bodies: Array, torque: Array, level: Array) -> GaussianPrior | None:
    """Builds the prior from the robot's description, scaled by its expected errors.

    Standard inertial parameters scatter about the description by each link's mass m, m l and m l^2, l its radius of
    gyration about its frame; regrouped, that is the covariance K S K' of base parameters, so that a combination which
    only light links feel is held tighter than one of heavy ones. Friction, rotor and offset scatter about what is
    described by three times what makes their joint's torque at the joint's limit velocity, friction beyond Coulomb and
    viscous friction by a fifth: a cubic term that a slow log leaves open must not explode beyond it.

    Args:
        base: base parameters.
        bodies: by whose size the links scatter (n, 10), such as the described ones.
        torque: each joint's torque RMS (n,) [N m or N].
        level: RMS of each column on the joint of its own (b,).

    Returns:
        The pull, or None where the description lacks inertial parameters.
    """
    model = base.model
    if not model.described or not np.any(model.robot.inertia):
        return None
    spread = np.zeros(model.size)
    links = link_spreads(bodies)
    own = {column: position for position, column in enumerate(base.independent)}
    for i, column in enumerate(model.columns):
        joint = column.joint - 1
        if column.term == "rigid_body":
            spread[i] = links[joint, SYMBOLS.index(column.symbol)]
        elif i in own:
            # A column that never acts is held at its description by any spread.
            spread[i] = usual_share(column) * torque[joint] / (level[own[i]] if level[own[i]] > SILENT_COLUMN else 1.0)
    return prior_of_spreads(base, spread, model.nominal)


def usual_share(column: Column) -> float:
    """Gives the torque that friction, rotor or offset of a joint may make, over that of the joint."""
    # The parts of friction beyond Coulomb and viscous friction are alike where rows at low speed do not count.
    return 0.2 if column.friction and column.symbol not in ("f1", "f2") else OWN_TORQUE_RATIO


def prior_of_spreads(base: BaseParameters, spread: Array, target: Array) -> GaussianPrior:
    """Builds a prior of base parameters from spreads (p,) of the standard parameters about a target (p,)."""
    covariance = (base.grouping * spread**2) @ base.grouping.T
    scale = lengths(covariance)
    # A description may have links of no size.
    normalised = covariance / scale[:, None] / scale + LEAST_RIDGE * np.eye(len(scale))
    precision = np.linalg.inv(normalised) / scale[:, None] / scale
    return GaussianPrior(precision, base.from_standard(target))


def inflate_conflicting_prior(
    pull: GaussianPrior, gram: Array, cross: Array, strength: float = 1.0, sigmas: float = 2.0
) -> GaussianPrior:
    """Weakens the prior where the data contradict it: errors by a missing rotor or tool may exceed a parameter's size.

    Parameters scatter about the description with heavy tails, independently in directions in which the information of
    the data and the prior are both diagonal. If the estimate is z > k standard deviations of the description away, the
    precision is divided by (z / k)^2 (the square of Huber's weights). z is found by iteration. Directions that the data
    do not determine keep their prior.

    Args:
        pull: prior of the parameters (p,), with its strength.
        gram: Gram matrix of the data (p, p), in the same units.
        cross: products of columns and torque (p,), in the same units.
        strength: factor of the prior's precision over that of the description's own scatter.
        sigmas: k.

    Returns:
        The weakened prior.
    """
    root = np.linalg.cholesky(pull.precision / strength)
    inverse = solve_triangular(root, np.eye(len(root)), lower=True)
    information, ways = np.linalg.eigh(inverse @ gram @ inverse.T)
    information = np.maximum(information, 0.0)
    aim = ways.T @ inverse @ (cross - gram @ pull.target)
    weights = np.ones(len(information))
    for _ in range(20):
        off = aim / (information + strength * weights)
        weights = 1.0 / np.maximum(1.0, (off / sigmas) ** 2)
    turned = root @ ways
    return GaussianPrior(strength * (turned * weights) @ turned.T, pull.target)


def link_spreads(inertia: Array) -> Array:
    """How far each inertial parameter of a link may be off: by the link's own mass m, by m l and by m l^2.

    Args:
        inertia: described parameters (n, 10); l is the radius of gyration about the link frame. Links much smaller
            than the largest count as some share of it.

    Returns:
        (n, 10), positive.
    """
    # A link may be wrong by its own size: its mass, its mass times its reach, its mass times its reach squared.
    mass = np.maximum(inertia[:, 0], 0.05 * inertia[:, 0].max())
    second = np.maximum(inertia[:, [4, 7, 9]].sum(axis=1) / 2, 0.0) / mass
    reach = np.sqrt(np.maximum(second, (0.3**2) * second.max()))
    return np.asarray(mass[:, None] * reach[:, None] ** np.array([0, 1, 1, 1, 2, 2, 2, 2, 2, 2]))


def friction_levels(base: BaseParameters, level: Array, fastest: Array) -> Array:
    """Raises the levels of friction columns to those at the limit velocity.

    Args:
        base: base parameters.
        level: RMS of each column on the joint of its own (b,).
        fastest: highest speed seen of each joint (n,); the limit velocity counts where the robot states one.

    Returns:
        Levels (b,).
    """
    limit = np.asarray(base.model.robot.limits.velocity, dtype=float)
    speed = np.where(np.isfinite(limit), np.maximum(limit, fastest), fastest)
    return np.maximum(level, base.model.friction_at(speed)[list(base.independent)])
