"""Priors of the base parameters: a fit then predicts other motions although its log leaves parameters open."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.base_models.baseline import Baseline
from estimation.diagnosis.recordings.log_reading import Recording
from estimation.regressions.parameter_priors import (
    OWN,
    SILENT,
    GaussianPrior,
    friction_levels,
    prior_from_description,
    usual_share,
)
from estimation.regressions.standard_parameters import mass_from_torque, reference_bodies

Array = NDArray[np.float64]

# Quantile of a joint's speed that counts as its largest.
FASTEST = 0.999


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
        pull = GaussianPrior(np.diag(np.maximum(share, SILENT) ** 2), np.zeros(len(own)))
    b, size = len(pull.target), baseline.columns.shape[2]
    m = size - b
    precision = np.zeros((size, size))
    precision[:b, :b] = pull.precision
    # Errors of the sign widths need a bound, too: rows that hardly contain them would allow any value.
    precision[range(b, size), range(b, size)] = 1.0 / (OWN * torque[:m]) ** 2
    return GaussianPrior(strength * precision, np.concatenate([pull.target, np.zeros(m)]))
