"""Detection limits of a planned experiment, for the expected noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_toeplitz

from estimation.diagnosis.base_models.baseline import build_baseline
from estimation.diagnosis.experiment_plans.detection_limits import Limit, find_limits
from estimation.diagnosis.hypothesis_tests.hypotheses import all_hypotheses
from estimation.diagnosis.hypothesis_tests.problem import Problem, build_problem
from estimation.diagnosis.hypothesis_tests.scan import measure
from estimation.diagnosis.noise_models.frequency_bands import Band
from estimation.diagnosis.noise_models.masked_rows import no_masked_rows
from estimation.diagnosis.noise_models.whitening import Whitening
from estimation.diagnosis.recordings.directions import SHARP, SURELY, sharpest_sign_velocity
from estimation.diagnosis.recordings.recording import Recording
from estimation.regressions.parameter_priors import GaussianPrior
from robots.base_parameters import find_base_parameters
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.plants.sensors import Sensors
from robots.regressor import TorqueModel
from robots.signals import Motion
from robots.terms.effects import EFFECTS

ORDER = 12
"""Order of the prediction filter. A sum of white and first-order noise has no exact finite one."""
ROUGH = 0.3
"""Coulomb friction added to choose the sharpness of the friction sign, over the torque's standard deviation."""


def planned_limits(
    model: TorqueModel, parameters: Array, motions: Sequence[Motion], *, noise: Sensors | None = None
) -> tuple[Limit, ...]:
    """Computes the detection limits of a planned experiment.

    Args:
        model: the torque model.
        parameters: its standard parameters (p,).
        motions: the planned motions, one after the other on one clock.
        noise: the expected torque noise; the defaults of `Sensors` without it.

    Returns:
        One limit per hypothesis, in the order of the catalogue.

    Raises:
        InputError: a parameter is unknown.
    """
    problem = planned_problem(model, parameters, motions, noise=noise or Sensors())
    return find_limits(problem, measure(problem, all_hypotheses(model.robot, list(EFFECTS.values()))))


def planned_problem(
    model: TorqueModel,
    parameters: Array,
    motions: Sequence[Motion],
    *,
    noise: Sensors,
    level: Array | None = None,
) -> Problem:
    """Builds the whitened regression of a planned experiment, with the model's torque as data.

    Args:
        model: the torque model.
        parameters: its standard parameters (p,).
        motions: the planned motions, one after the other on one clock.
        noise: the expected torque noise.
        level: standard deviation of the noise (n,) [N m or N]; by default the share of the torque stated by `noise`.

    Raises:
        InputError: a parameter is unknown.
    """
    if not np.isfinite(parameters).all():
        missing = model.columns[int(np.argmin(np.isfinite(parameters)))]
        raise InputError(
            f"{model.robot.name}: {missing.name} is not known",
            joint=missing.joint,
            remedy="identify the robot first, and give its model.json",
        )
    joined = Motion.concatenate(motions)
    starts = tuple(int(s) for s in np.cumsum([0, *(len(motion) for motion in motions[:-1])]))
    step = float(np.median(np.diff(joined.t)))
    recording = Recording(
        t=joined.t,
        starts=starts,
        q=joined.q,
        dq=joined.dq,
        ddq=joined.ddq,
        tau=model.torque(joined.q, joined.dq, joined.ddq, parameters),
        step=step,
        cycles=(None,) * len(motions),
        cutoff=0.5 / step,
        sign_unknown=_at_reversals(joined.dq, starts),
        sign_known_from_velocity=np.zeros(joined.q.shape, dtype=bool),
        reversal_acceleration_error=np.zeros(joined.q.shape[1]),
        floor=np.zeros(joined.q.shape[1]),
        names=tuple(f"motion {i}" for i in range(1, len(motions) + 1)),
    )
    whitening = expected_whitening(recording, noise, level)
    # The sharpness of the sign is chosen from friction, which a description may not contain.
    rough = recording.tau + ROUGH * recording.tau.std(axis=0) * np.tanh(joined.dq / SHARP)
    baseline = build_baseline(find_base_parameters(model), replace(recording, tau=rough), whitening.scale)
    # The data determine the known parameters exactly, so no prior is needed.
    size = baseline.columns.shape[2]
    free = GaussianPrior(np.zeros((size, size)), np.zeros(size))
    return build_problem(recording, baseline, whitening, pull=free)


def _at_reversals(dq: Array, starts: tuple[int, ...]) -> NDArray[np.bool_]:
    """Marks rows (N, n) beside reversals, and rows too slow for a known friction sign."""
    turned = np.zeros(dq.shape, dtype=bool)
    turned[1:] = dq[1:] * dq[:-1] < 0
    turned[list(starts)] = False
    beside = turned | np.roll(turned, -1, axis=0)
    return beside | (np.abs(dq) < SURELY * np.array([sharpest_sign_velocity(column) for column in dq.T]))


def expected_whitening(recording: Recording, noise: Sensors, level: Array | None = None) -> Whitening:
    """Builds the whitening of expected sensor noise: a white and a first-order coloured part.

    Args:
        recording: the planned motion with its torque.
        noise: the expected torque noise.
        level: standard deviation of the noise (n,) [N m or N]; by default the share of the torque stated by `noise`.
    """
    size = noise.torque_noise * np.sqrt(np.mean(recording.tau**2, axis=0)) if level is None else level
    size = np.maximum(size, 1e-3 * max(float(size.max()), 1e-9))
    rho = float(np.exp(-recording.step / noise.correlation_time)) if noise.correlation_time else 0.0
    lags = noise.coloured_share * rho ** np.arange(ORDER + 1)
    lags[0] = 1.0
    taps = solve_toeplitz(lags[:-1], lags[1:])
    innovation = float(np.sqrt(lags[0] - taps @ lags[1:]))
    n = recording.n
    return Whitening(
        coefficients=(taps,) * n,
        scale=size * innovation,
        precision=np.eye(n),
        starts=recording.starts,
        masked=no_masked_rows(n),
        bands=(Band(np.zeros(0), 1, 0.5 / recording.step),) * recording.n,
    )
