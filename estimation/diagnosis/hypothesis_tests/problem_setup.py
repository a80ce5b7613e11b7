"""Setup of the whitened regression: fits the base model and projects it out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.base_models.baseline import FAINT, Baseline
from estimation.diagnosis.base_models.priors import base_model_prior
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.noise_models.high_frequency_band import HighBand
from estimation.diagnosis.noise_models.whitening import Whitening
from estimation.diagnosis.recordings.log_reading import Recording
from estimation.linear_algebra.orthonormal import orthonormal
from estimation.regressions.parameter_priors import GaussianPrior, inflate_conflicting_prior
from robots.terms.effect_bases.gear_load import ExtraGearLoad, with_gear_load

Array = NDArray[np.float64]


def build_problem(
    recording: Recording,
    baseline: Baseline,
    whitening: Whitening,
    *,
    extra: Array | None = None,
    pull: GaussianPrior | None = None,
    upper: HighBand | None = None,
    followed: Array | None = None,
    bearing: ExtraGearLoad | None = None,
) -> Problem:
    """Builds the whitened regression and fits the base model in it.

    Args:
        recording: the data.
        baseline: the base model.
        whitening: filters that whiten the noise.
        extra: torque (N, n) of known effects [N m or N], subtracted before the base parameters are fitted.
        pull: prior of base parameters and nuisance; by default `base_model_prior`, inflated where the data contradict
            it.
        upper: regression above the bands.
        followed: the part (N, n) of the known effects' torque that effects of time delay also delay [N m or N].
        bearing: gear load of the known effects; None for none.
    """
    n = recording.n
    root = np.linalg.cholesky(whitening.precision)  # P = L L'
    columns = baseline.columns
    norms = np.sqrt((columns**2).sum(axis=(0, 1)))
    white = whitening.all(columns[:, :, norms > 0])
    # A column that acts only in rows of unknown friction sign is rounding after whitening.
    left = np.sqrt((white**2).sum(axis=(0, 1))) * whitening.scale.max() / norms[norms > 0]
    white = white[:, :, left > FAINT]
    N = len(white)
    mixed = np.einsum("jk,njb->nkb", root, white, optimize=True)
    Q = orthonormal(mixed.reshape(N * n, -1), FAINT).reshape(N, n, -1)
    tau = whitening.all(recording.tau)
    tilted = tau @ root
    tilted = tilted - np.einsum("nkb,b->nk", Q, np.einsum("nkb,nk->b", Q, tilted, optimize=True), optimize=True)
    scales = whitening.scales(len(recording))
    own = recording.tau if extra is None else recording.tau - extra
    weights = ~recording.sign_unknown / scales
    moments = baseline.moments(weights, own).joined()
    if pull is None:
        strength = whitening.row_weight
        pull = inflate_conflicting_prior(
            base_model_prior(baseline, recording, strength), moments.gram[0], moments.cross[0], strength
        )
    values = moments.pulled(pull).posterior()[: baseline.base.size]
    alone = values if extra is None else baseline.fitted(weights, recording.tau, pull)
    remainder = recording.tau - baseline.regressor @ alone
    now = with_gear_load(baseline.situation(recording, values), bearing)
    return Problem(
        recording=recording,
        baseline=baseline,
        whitening=whitening,
        situation=now,
        weighted_base_columns=np.ascontiguousarray(np.einsum("jk,nkb->jnb", root, Q, optimize=True), dtype=np.float32),
        residual=tilted @ root.T,
        white=np.linalg.solve(root.T, tilted.T).T,
        energy=float(np.sum(tilted**2)),
        base_residual=remainder,
        prior=pull,
        high_band=upper,
        delayed_torque_state=None if followed is None else now.beside(followed),
        extra_load=bearing,
    )
