"""What holds base parameters that a log leaves open, so that another motion is not predicted absurdly."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from estimation.diagnosis.base_models.baseline import Baseline
from estimation.diagnosis.recordings.log_reading import Recording
from estimation.regressions.parameter_priors import OWN, SILENT, GaussianPrior, friction_levels, prior_from_description

Array = NDArray[np.float64]

# Speed that a joint exceeds in a thousandth of the time only.
FASTEST = 0.999
# Standard deviations of a description that it may be wrong by before it is let go, and steps in which it is.
CONFLICT_SIGMAS, CONFLICT_ROUNDS = 2.0, 20
# Directions below this share of the largest are not determined.
FAINT = 1e-12


def base_model_prior(baseline: Baseline, recording: Recording, strength: float = 1.0) -> GaussianPrior:
    """Pulls base parameters as `identify` does, as strongly as the noise makes right.

    Parameters scatter about the robot's description by their own size (`prior_from_description`). Against rows that
    count by their noise's inverse variance the pull is then their a-priori precision, and the fit is that of the
    largest posterior density. Coloured noise makes rows tell less than their number: the pull counts by the noise's
    power density at rest over that of white noise.

    Where nothing is described, no base parameter is to make more than some times the torque that its joints have.

    Args:
        baseline: the base model on the data.
        recording: the data.
        strength: rows of the noise that tell as much of a slow torque as one of white noise (`Whitening.row_weight`).

    Returns:
        Of base parameters and the baseline's nuisance (b + m), in units of rows over the noise's scale.
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
    pull = prior_from_description(baseline.base, torque, raised)
    if pull is None:
        levels[own, np.arange(len(own))] = raised
        share = (levels / torque[:, None]).max(axis=0) / OWN
        pull = GaussianPrior(np.diag(np.maximum(share, SILENT) ** 2), np.zeros(len(own)))
    b, m = len(pull.target), baseline.nuisance.shape[2]
    precision = np.zeros((b + m, b + m))
    precision[:b, :b] = pull.precision
    # A sign may be less sharp by so much; without a bound, rows that hardly show it would say anything.
    precision[range(b, b + m), range(b, b + m)] = 1.0 / (OWN * torque[:m]) ** 2
    return GaussianPrior(strength * precision, np.concatenate([pull.target, np.zeros(m)]))


def inflate_conflicting_prior(pull: GaussianPrior, gram: Array, cross: Array, strength: float = 1.0) -> GaussianPrior:
    """Lets go of a description where data contradict it: what a file lacks, a rotor or a tool, is not off by its size.

    Parameters scatter about the description with heavy tails, independently along the directions in which data and
    description are both diagonal. Where these say z > 2 standard deviations of the description, the pull there counts
    (z / 2)^2 times less, z found by iteration (Huber's weights squared); what the data leave open stays held.

    Args:
        pull: on base parameters and nuisance (p,), with its strength.
        gram: of the data, in the same units (p, p).
        cross: of the data (p,).
        strength: by which the pull's precision is more than that of what could be wrong.
    """
    root = np.linalg.cholesky(pull.precision / strength)
    inverse = solve_triangular(root, np.eye(len(root)), lower=True)
    information, ways = np.linalg.eigh(inverse @ gram @ inverse.T)
    information = np.maximum(information, 0.0)
    aim = ways.T @ inverse @ (cross - gram @ pull.target)
    weights = np.ones(len(information))
    for _ in range(CONFLICT_ROUNDS):
        off = aim / (information + strength * weights)
        weights = 1.0 / np.maximum(1.0, (off / CONFLICT_SIGMAS) ** 2)
    turned = root @ ways
    return GaussianPrior(strength * (turned * weights) @ turned.T, pull.target)


def solve_map(gram: Array, cross: Array, pull: GaussianPrior) -> Array:
    """Solves normal equations (p, p), (p,) with a pull on the first columns, or all.

    Directions that neither determines stay at zero: the fit is that of least norm.
    """
    root, aim = _root(gram, pull), _aim(cross, pull)
    return np.asarray(root @ (root.T @ aim))


def solve_least_squares(gram: Array, cross: Array) -> Array:
    """Solves normal equations (p, p), (p,) that nothing holds."""
    return solve_map(gram, cross, GaussianPrior(np.zeros((0, 0)), np.zeros(0)))


def explained_chi2(gram: Array, cross: Array, pull: GaussianPrior) -> float:
    """Squared torque that such a fit explains, less what the pull costs it."""
    projected = _root(gram, pull).T @ _aim(cross, pull)
    return float(projected @ projected - pull.target @ pull.precision @ pull.target)


def _aim(cross: Array, pull: GaussianPrior) -> Array:
    aim = cross.copy()
    aim[: len(pull.target)] += pull.precision @ pull.target
    return aim


def _root(gram: Array, pull: GaussianPrior) -> Array:
    """Gives R (p, r) with R R' the inverse of a Gram matrix (p, p) and a pull, in directions that these determine."""
    b = len(pull.target)
    gram = gram.copy()
    gram[:b, :b] += pull.precision
    scale = np.sqrt(np.maximum(np.diag(gram), 0.0))
    scale[scale == 0] = 1.0
    values, vectors = np.linalg.eigh(gram / scale[:, None] / scale)
    kept = values > FAINT * values[-1]
    return np.asarray(vectors[:, kept] / np.sqrt(values[kept]) / scale[:, None])
