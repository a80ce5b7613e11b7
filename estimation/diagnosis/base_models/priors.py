"""Priors of the base parameters: a fit then predicts other motions although its log leaves parameters open."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.base_models.baseline import Baseline
from estimation.diagnosis.recordings.log_reading import Recording
from estimation.linear_algebra.scaled import inverse_root
from estimation.regressions.parameter_priors import (
    OWN_TORQUE_RATIO,
    SILENT_COLUMN,
    GaussianPrior,
    friction_levels,
    prior_from_description,
    usual_share,
)
from estimation.regressions.standard_parameters import mass_from_torque, reference_bodies

Array = NDArray[np.float64]

# Quantile of a joint's speed that counts as its largest.
FASTEST = 0.999
# Directions below this share of the largest are not determined.
FAINT = 1e-12


def base_model_prior(baseline: Baseline, recording: Recording, strength: float = 1.0) -> GaussianPrior:
    """Builds the prior of the base parameters from the robot's description, as `identify` does, scaled to the noise.

    Parameters scatter about the description by their own size (`prior_from_description`). Rows are weighted by the
    inverse variance of their noise. The prior then enters with its precision, and the fit maximises the posterior
    density. In coloured noise, rows are less informative than their number suggests. The prior is therefore multiplied
    by the noise density at zero frequency over that of white noise.

    If the description lacks inertial parameters, the prior limits the torque of each parameter to some times that of
    the joints.

    Args:
        baseline: the base model on the data.
        recording: the data.
        strength: number of rows that inform as much on a slow torque as one row of white noise
            (`Whitening.row_weight`).

    Returns:
        Prior of base parameters and nuisance (b + m), in units of rows weighted by the noise.
    """
    counts = ~recording.sign_unknown
    number = np.maximum(counts.sum(axis=0), 1)
    torque = np.sqrt((recording.tau**2 * counts).sum(axis=0) / number)
    torque = np.maximum(torque, 1e-3 * max(float(torque.max()), 1e-12))
    levels = np.sqrt(np.einsum("njb,nj->jb", baseline.regressor**2, counts.astype(float)) / number[:, None])
    own = np.array([column.joint - 1 for column in baseline.base.columns])
    raised = friction_levels(
        baseline.base, levels[own, np.arange(len(own))], np.quantile(np.abs(recording.dq), FASTEST, axis=0)
    )
    robot = baseline.base.model.robot
    bodies, _ = reference_bodies(robot, mass_from_torque(robot, float(torque.max())))
    pull = prior_from_description(baseline.base, bodies, torque, raised)
    if pull is None:
        levels[own, np.arange(len(own))] = raised
        usual = np.array([usual_share(column) for column in baseline.base.columns])
        share = (levels / torque[:, None]).max(axis=0) / usual
        pull = GaussianPrior(np.diag(np.maximum(share, SILENT_COLUMN) ** 2), np.zeros(len(own)))
    b, m = len(pull.target), baseline.nuisance.shape[2]
    precision = np.zeros((b + m, b + m))
    precision[:b, :b] = pull.precision
    # Errors of the sign widths need a bound, too: rows that hardly contain them would allow any value.
    precision[range(b, b + m), range(b, b + m)] = 1.0 / (OWN_TORQUE_RATIO * torque[:m]) ** 2
    return GaussianPrior(strength * precision, np.concatenate([pull.target, np.zeros(m)]))


def solve_map(gram: Array, cross: Array, pull: GaussianPrior) -> Array:
    """Solves normal equations (p, p), (p,) with a prior on the first columns, or on all of them.

    Directions that neither the data nor the prior determine are zero, as in the least-norm solution.
    """
    root, aim = _root(gram, pull), _aim(cross, pull)
    return np.asarray(root @ (root.T @ aim))


def solve_least_squares(gram: Array, cross: Array) -> Array:
    """Solves normal equations (p, p), (p,) without a prior."""
    return solve_map(gram, cross, GaussianPrior(np.zeros((0, 0)), np.zeros(0)))


def explained_chi2(gram: Array, cross: Array, pull: GaussianPrior) -> float:
    """Computes the energy that the fit with a prior explains, minus the penalty of the prior."""
    projected = _root(gram, pull).T @ _aim(cross, pull)
    return float(projected @ projected - pull.target @ pull.precision @ pull.target)


def _aim(cross: Array, pull: GaussianPrior) -> Array:
    aim = cross.copy()
    aim[: len(pull.target)] += pull.precision @ pull.target
    return aim


def _root(gram: Array, pull: GaussianPrior) -> Array:
    """Factorises the inverse of a Gram matrix (p, p) plus prior as R R', with R (p, r), in determined directions."""
    b = len(pull.target)
    gram = gram.copy()
    gram[:b, :b] += pull.precision
    return inverse_root(gram, FAINT)
