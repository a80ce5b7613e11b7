"""Sets up the whitened regression: fits the base model and projects it out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.base_models.baseline import FAINT, Baseline
from estimation.diagnosis.base_models.priors import base_model_prior, inflate_conflicting_prior, solve_map
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.noise_models.high_frequency_band import HighBand
from estimation.diagnosis.noise_models.whitening import Whitening
from estimation.diagnosis.recordings.log_reading import Recording
from estimation.linear_algebra.orthonormal import orthonormal
from estimation.regressions.parameter_priors import GaussianPrior
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
    """Fits the base model to white data.

    Args:
        recording: the data.
        baseline: the base model.
        whitening: makes the noise white.
        extra: torque (N, n) of effects that are known already, taken off before the base model's situation is computed.
        pull: what holds base parameters that the data leave open; by default `base_model_prior`, loosened.
        upper: the frequencies above the bands.
        followed: that part (N, n) of the known effects' torque which others may make late.
        bearing: what of the known effects the gears bear; None for nothing.
    """
    n = recording.n
    root = np.linalg.cholesky(whitening.precision)  # P = L L'
    columns = np.concatenate([baseline.regressor, baseline.nuisance], axis=2)
    norms = np.sqrt((columns**2).sum(axis=(0, 1)))
    white = whitening.all(columns[:, :, norms > 0])
    # What is left of a column that acts in rows of unknown direction alone is rounding.
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
    gram, cross = normal_equations(baseline, ~recording.sign_unknown / scales, own)
    if pull is None:
        strength = whitening.row_weight
        pull = inflate_conflicting_prior(
            base_model_prior(baseline, recording, strength), gram.sum(axis=0), cross.sum(axis=0), strength
        )
    values = solve_map(gram.sum(axis=0), cross.sum(axis=0), pull)[: baseline.base.size]
    alone = values if extra is None else fit_values(baseline, scales, recording.sign_unknown, recording.tau, pull)
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


def fit_values(baseline: Baseline, scale: Array, unsure: NDArray[np.bool_], tau: Array, pull: GaussianPrior) -> Array:
    """Fits base parameters (b,) to torque (N, n), weighed by the noise of each joint (n,) or of each row too (N, n).

    Directions that the log does not determine go where the pull has them.
    """
    gram, cross = normal_equations(baseline, ~unsure / scale, tau)
    return solve_map(gram.sum(axis=0), cross.sum(axis=0), pull)[: baseline.base.size]


def normal_equations(baseline: Baseline, weights: Array, tau: Array) -> tuple[Array, Array]:
    """Gives each joint's normal equations (n, p, p), (n, p) of base parameters and nuisance, rows weighed (N, n)."""
    size = baseline.regressor.shape[2] + baseline.nuisance.shape[2]
    gram, cross = np.zeros((tau.shape[1], size, size)), np.zeros((tau.shape[1], size))
    for j, weight in enumerate(weights.T):
        own = np.concatenate([baseline.regressor[:, j], baseline.nuisance[:, j]], axis=1) * weight[:, None]
        gram[j] = own.T @ own
        cross[j] = own.T @ (tau[:, j] * weight)
    return gram, cross
