"""Tests of the joint fit of base model and effects: coefficients, standard errors, and the saved model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import refine
from estimation.diagnosis.hypothesis_tests.scoring import accept
from estimation.diagnosis.joint_fits.extended_fit import _covariance, _narrowed, fit_extended
from estimation.diagnosis.joint_fits.total_torque import effect_columns
from estimation.diagnosis.recordings.log_reading import build_recording
from estimation.diagnosis.recordings.recording import Recording
from estimation.models.extension import find_effect
from estimation.models.model import load_model
from estimation.predictions.virtual_robot import virtual_robot
from robots.robot import Robot
from robots.signals import Log, Motion
from robots.terms.effects import EFFECTS

MIDDLE = 10.0


@pytest.fixture(scope="module")
def recording(arm: Robot, arm_log: Callable[..., Log]) -> Recording:
    """Returns a recording of the arm without effects."""
    return build_recording(arm, [arm_log(torque_noise=0.02)])


def _estimable(problem: Problem, member: FittedEffect) -> np.ndarray:
    """Returns which coefficients the rows determine, by the null space of all columns."""
    known = np.concatenate([problem.baseline.columns, problem.dense(member.hypothesis, member.shape)], axis=2)[::7]
    flat = known.reshape(-1, known.shape[2])
    norms = np.linalg.norm(flat, axis=0)
    flat = flat / np.where(norms > 0, norms, 1.0)
    _, sizes, rows = np.linalg.svd(flat, full_matrices=True)
    null = rows[int(np.sum(sizes > 1e-6 * sizes[0])) :]
    return np.linalg.norm(null, axis=0)[-len(member.coefficients) :] < 0.1


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "joint", "shape"),
    [("payload_change", None, (MIDDLE, 1.0, 0.0)), ("torque_sensor_drift", 1, None), ("friction_step", 2, (MIDDLE,))],
)
def test_what_a_log_leaves_open_has_no_interval(
    recording: Recording,
    pose_arm: Callable[..., Problem],
    name: str,
    joint: int | None,
    shape: tuple[float, ...] | None,
) -> None:
    """Coefficients that the log does not determine have infinite errors, all others finite ones.

    They are zero, except where a body with the determined mass and moments must have some.
    """
    hypothesis = Hypothesis(EFFECTS[name], joint)
    problem = pose_arm(recording)
    point = shape or hypothesis.effect.grid(problem.situation, joint)[1]
    columns = problem.dense(hypothesis, point)
    posed = pose_arm(replace(recording, tau=recording.tau + 0.5 * columns[:, :, 0]))
    member = refine(posed, hypothesis, point, accept(posed, ()))
    fitted = fit_extended(posed, [member], {})
    size = len(member.coefficients)
    errors = np.sqrt(np.diag(fitted.model.extensions[0].covariance))[:size]
    estimable = _estimable(posed, member)
    np.testing.assert_array_equal(np.isfinite(errors), estimable)
    assert errors[estimable].min() > 0
    assert not fitted.effects[0][:size][~estimable].any()
    if not hypothesis.effect.constrained:
        assert not fitted.model.extensions[0].coefficients[~estimable].any()
    assert estimable.sum() == {"payload_change": 4, "torque_sensor_drift": 2, "friction_step": 2}[name]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effect", "joint", "known", "size"),
    [
        ("friction_step", 1, (), (0.5, 0.3)),
        ("payload_change", None, (1.0, 0.0), (0.5, 0.1, 0.0, 0.0, 0.001, 0.0, 0.0, 0.021, 0.0, 0.021)),
    ],
)
def test_a_change_between_two_logs_is_within_the_pause(
    arm: Robot,
    arm_log: Callable[..., Log],
    pose_arm: Callable[..., Problem],
    effect: str,
    joint: int | None,
    known: tuple[float, ...],
    size: tuple[float, ...],
) -> None:
    """The time of a change between two logs has the pause as its interval."""
    first, hypothesis = arm_log(torque_noise=0.02), Hypothesis(EFFECTS[effect], joint)
    logs = build_recording(arm, [first, replace(first, t=first.t + float(np.ptp(first.t)) + 30.0)])
    ends, begins = (float(logs.t[at]) for at in (logs.starts[1] - 1, logs.starts[1]))
    columns = pose_arm(logs).dense(hypothesis, (begins, *known))
    posed = pose_arm(replace(logs, tau=logs.tau + columns @ np.array(size)))
    member = refine(posed, hypothesis, (begins, *known), accept(posed, ()))
    extension = fit_extended(posed, [member], {}).model.extensions[0]
    error = float(np.sqrt(extension.covariance[len(size), len(size)]))
    assert extension.shape[0] == pytest.approx((ends + begins) / 2)
    assert 1.96 * error == pytest.approx((begins - ends) / 2, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["pattern:load:0:even", "load_dependent_friction", "joint_elasticity"])
def test_the_model_is_what_was_fitted(
    arm: Robot, recording: Recording, pose_arm: Callable[..., Problem], tmp_path: Path, name: str
) -> None:
    """The model's torque, also after saving, is that of base model and effect together.

    For effects of the load, the base model's share of the load depends on the fit; the model evaluates them with the
    load used in the fit.
    """
    effect = find_effect(name)
    hypothesis, problem = Hypothesis(effect, 1), pose_arm(recording)
    shape = effect.grid(problem.situation, 1)[0]
    columns = problem.dense(hypothesis, shape)
    size = 0.2 * recording.tau[:, 0].std() / columns[:, 0].std(axis=0).max()
    posed = pose_arm(replace(recording, tau=recording.tau + size * columns[:, :, 0]))
    member = refine(posed, hypothesis, shape, accept(posed, ()))
    fitted = fit_extended(posed, [member], {"gravities": []})
    base = posed.baseline.regressor @ fitted.values[: posed.baseline.base.size]
    own = posed.dense(hypothesis, member.shape) @ fitted.model.extensions[0].coefficients
    motion = (recording.q, recording.dq, recording.ddq, recording.t)
    fitted.model.save(tmp_path / "model.json")
    for model in (fitted.model, load_model(tmp_path)):
        np.testing.assert_allclose(model.torque(*motion), base + own, rtol=0, atol=1e-8 * recording.tau.std())
        played = virtual_robot(model).torque(Motion(recording.t, *motion[:3]))
        np.testing.assert_allclose(played, base + own, rtol=0, atol=1e-8 * recording.tau.std())
    if effect.name.startswith("pattern"):
        other = replace(fitted.model, felt=None).torque(*motion)
        assert np.abs(other - base - own).max() > 1e-3 * recording.tau.std()


@pytest.mark.slow
def test_a_vibration_keeps_its_phase_in_a_later_motion(
    recording: Recording, pose_arm: Callable[..., Problem], tmp_path: Path
) -> None:
    """A vibration has the right phase in a motion that begins later, also after saving."""
    effect = find_effect("pattern:vibration:0:even")
    hypothesis, problem = Hypothesis(effect, 1), pose_arm(recording)
    wave = 0.2 * recording.tau[:, 0].std() * np.sin(2 * np.pi * 3.3 * recording.t + 0.4)
    posed = pose_arm(replace(recording, tau=recording.tau + wave[:, None] * [1.0, 0.0]))
    member = refine(posed, hypothesis, (3.3,), accept(posed, ()))
    fitted = fit_extended(posed, [member], {"gravities": []})
    fitted.model.save(tmp_path / "model.json")
    later = slice(1013, None)
    motion = [x[later] for x in (recording.q, recording.dq, recording.ddq, recording.t)]
    for model in (fitted.model, load_model(tmp_path)):
        reported = (model.torque(*motion) - model.torque(*motion[:3]))[:, 0]
        assert np.corrcoef(reported, wave[later])[0, 1] > 0.99
    (states, *_), _ = effect_columns(problem, replace(recording, **_rows(recording, later)), [member])
    assert states.origin == recording.t[0]


def _rows(recording: Recording, rows: slice) -> dict[str, object]:
    """Returns a recording's fields on some of its rows."""
    names = ("t", "q", "dq", "ddq", "tau", "sign_unknown", "sign_known_from_velocity")
    return {"starts": (0,), **{name: getattr(recording, name)[rows] for name in names}}


@pytest.mark.slow
def test_no_log_knows_a_delay_better_than_its_formula(
    arm: Robot, arm_log: Callable[..., Log], pose_arm: Callable[..., Problem]
) -> None:
    """The standard error of a delay contains the formula's 5 % and the noise."""
    recording = build_recording(arm, [arm_log(torque_noise=0.002)])
    hypothesis = Hypothesis(EFFECTS["time_delay"], None)
    delay = 0.01
    problem = pose_arm(recording)
    columns = problem.dense(hypothesis, (delay,))
    posed = pose_arm(replace(recording, tau=recording.tau + delay * columns[:, :, 0]))
    member = refine(posed, hypothesis, (0.008,), accept(posed, ()))
    extension = fit_extended(posed, [member], {}).model.extensions[0]
    (value,), error = extension.coefficients, float(np.sqrt(extension.covariance[0, 0]))
    by_noise = np.sqrt(member.birge_ratio / member.group.gram[0, 0])
    assert by_noise < 0.04 * delay
    assert (0.05 * value) ** 2 + (0.5 * by_noise) ** 2 < error**2 < (0.05 * value) ** 2 + (2 * by_noise) ** 2


def test_a_column_that_is_hardly_one_is_left_open() -> None:
    """A column of size 1e-170 counts as not determined, without an overflow."""
    matrix = np.random.default_rng(0).normal(size=(50, 3)) * [1.0, 1.0, 1e-170]
    covariance, lost = _covariance(matrix)
    assert covariance[:2, :2] == pytest.approx(np.linalg.inv(matrix[:, :2].T @ matrix[:, :2]))
    assert np.isfinite(covariance).all()
    assert lost.tolist() == [False, False, True]


@pytest.mark.parametrize("variance", [4.0, 0.01, np.inf])
def test_what_is_one_quantity_reported_twice_is_known_as_well_as_the_other(variance: float) -> None:
    """A tie reduces the second variance to the given value at most, and the covariance stays positive definite."""
    covariance = np.array([[0.25, 0.1 if np.isinf(variance) else 0.4 * np.sqrt(variance)], [0.0, variance]])
    covariance[1, 0] = covariance[0, 1]
    narrowed = _narrowed(covariance, 1, 0.3)
    assert narrowed[0, 0] == 0.25
    assert narrowed[1, 1] == pytest.approx(min(variance, 0.09))
    assert np.linalg.eigvalsh(narrowed).min() > 0
    if np.isfinite(variance):
        correlations = [c[0, 1] / np.sqrt(c[0, 0] * c[1, 1]) for c in (covariance, narrowed)]
        assert correlations[1] == pytest.approx(correlations[0])


@pytest.mark.parametrize("name", ["time_delay", "current_lag"])
def test_a_delay_and_its_reversals_differ_by_what_a_factor_allows(name: str) -> None:
    """A factor of 1.6 around 2 ms, 1.25 to 3.2 ms, counts as a 95 % interval."""
    ((coefficient, shape, half),) = EFFECTS[name].ties(np.array([2e-3]))
    assert (coefficient, shape) == (0, 0)
    assert half == pytest.approx((3.2e-3 - 1.25e-3) / 2)
    assert EFFECTS["stribeck"].ties(np.array([1.0])) == ()
