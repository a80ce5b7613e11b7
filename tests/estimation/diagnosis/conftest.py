"""Fixtures: the whitened regression problem of the arm's logs, and a motion of six joints."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from estimation.diagnosis.base_models.baseline import base_model_prior, base_parameters, build_baseline, inertia_matrix
from estimation.diagnosis.hypothesis_tests.problem import Problem, build_problem
from estimation.diagnosis.noise_models.high_frequency_band import build_high_band
from estimation.diagnosis.noise_models.noise_estimate import estimate_whitening
from estimation.diagnosis.noise_models.noise_nuisance_basis import build_nuisance_projection
from estimation.diagnosis.recordings.recording import Recording
from robots import load_robot
from robots.regressor import default_model
from robots.robot import Robot
from robots.terms.effects import Situation, situation


@pytest.fixture(scope="session")
def pose_arm(arm: Robot) -> Callable[..., Problem]:
    """Fits the arm's base model to a recording, estimates the noise, and builds the whitened regression problem."""

    def build(recording: Recording, wider: float | None = None) -> Problem:
        baseline = build_baseline(base_parameters(arm, "coulomb-viscous", (0.001, 0.001)), recording)
        pull = base_model_prior(baseline, recording)
        values = baseline.fitted(~recording.sign_unknown / recording.tau.std(axis=0), recording.tau, pull)
        residual = recording.tau - baseline.regressor @ values
        inertia = inertia_matrix(baseline, recording, values)
        spared = build_nuisance_projection(recording, baseline, residual)
        whitening = estimate_whitening(recording, residual, baseline.base.size, inertia, spared=spared)
        upper = None
        if wider is not None:
            wide = estimate_whitening(recording, residual, baseline.base.size, inertia, wider, spared)
            upper = build_high_band(recording, baseline, residual, residual, whitening.bands, wide)
        return build_problem(recording, baseline, whitening, upper=upper)

    return build


@pytest.fixture(scope="session")
def swept() -> Situation:
    """Returns a motion of six joints under gravity, with friction."""
    robot = load_robot("ur10")
    t = 0.02 * np.arange(500)
    rates = np.array([0.9, 1.1, 1.3, 1.7, 2.1, 2.6])
    q = 0.6 * np.sin(np.outer(t, rates))
    dq, ddq = 0.6 * rates * np.cos(np.outer(t, rates)), -0.6 * rates**2 * np.sin(np.outer(t, rates))
    model = default_model(robot)
    return situation(model, model.nominal, 100.0 + t, q, dq, ddq)
