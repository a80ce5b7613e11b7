"""Tests of the whitened regression: scores against plain least squares, bounds, null distribution, projections."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import chi2

from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.scan import measure, neg_log_p, scan
from estimation.diagnosis.hypothesis_tests.scoring import accept, score
from estimation.diagnosis.recordings.log_reading import build_recording
from robots.common import forks
from robots.plants import Plant
from robots.robot import Robot
from robots.signals import Log
from robots.terms.effects import EFFECTS


@pytest.fixture(scope="module")
def problem(arm: Robot, arm_log: Callable[..., Log], pose_arm: Callable[..., Problem]) -> Problem:
    """Returns the whitened problem of a log without effects."""
    return pose_arm(build_recording(arm, [arm_log(torque_noise=0.02)]))


def _written_out(problem: Problem, extra: np.ndarray) -> tuple[float, float]:
    """Computes the squared white residual of the base model without and with more columns, by numpy's least squares."""
    root = np.linalg.cholesky(problem.whitening.precision)
    base = problem.baseline.columns
    tau = (problem.whitening.all(problem.recording.tau) @ root).reshape(-1)
    left = []
    for columns in (base, np.concatenate([base, extra], axis=2)):
        white = np.einsum("jk,njb->nkb", root, problem.whitening.all(columns))
        flat = white.reshape(len(tau), -1)
        norms = np.linalg.norm(flat, axis=0)
        # Columns that act only in rows with an unknown sign are rounding errors, which differ between machines.
        flat = flat[:, norms > 1e-6] / norms[norms > 1e-6]
        left.append(float(np.sum((tau - flat @ np.linalg.lstsq(flat, tau, rcond=1e-9)[0]) ** 2)))
    return left[0], left[1]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["asymmetric_friction", "payload_change", "torque_sensor_drift"])
def test_a_score_is_the_fall_of_the_squared_residual(problem: Problem, name: str) -> None:
    """The gain of a hypothesis is the decrease of the squared residual in plain least squares."""
    effect = EFFECTS[name]
    joint = None if effect.whole_robot else 1
    hypothesis = Hypothesis(effect, joint)
    shapes = effect.grid(problem.situation, joint)
    shape = shapes[len(shapes) // 2]
    joints, columns = problem.columns_of(hypothesis, shape)
    result = score(problem, problem.group(joints, columns), accept(problem, ()))
    dense = np.zeros((len(problem.recording), problem.n, columns[0].shape[1]))
    for j, part in zip(joints, columns, strict=True):
        dense[:, j] = part
    before, after = _written_out(problem, dense)
    assert problem.energy == pytest.approx(before, rel=1e-6)
    # Columns are stored in single precision, and directions with almost no energy are left out.
    assert result.gain == pytest.approx(before - after, abs=0.02 * (before - after) + 0.3)


def test_a_response_that_diverges_acts_nowhere() -> None:
    """A column too large for single precision is zero, as on a base model without a stable motion; others stay."""
    X = np.ones((5, 2, 3))
    X[1:, 0, 1], X[0, 1, 2] = 1e20, np.nan
    effect = SimpleNamespace(needs_full_rate=False, columns=lambda *_: X)
    joints, columns = Hypothesis(effect, None).columns(SimpleNamespace(), ())  # type: ignore[arg-type]
    assert joints == (0, 1)
    assert columns[0].tolist() == [[1.0, 0.0, 1.0]] * 5
    assert columns[1].tolist() == [[1.0, 1.0, 0.0], *[[1.0, 1.0, 1.0]] * 4]


def test_accepted_effects_are_projected_out(problem: Problem) -> None:
    """Beside itself an effect has no gain; beside another, gains add up to that of both together."""
    groups = []
    for name, shape in (("asymmetric_friction", ()), ("load_dependent_friction", (1.0, 0.0))):
        joints, columns = problem.columns_of(Hypothesis(EFFECTS[name], 1), shape)
        groups.append(problem.group(joints, columns))
    alone = accept(problem, (groups[0],))
    assert score(problem, groups[0], alone).degrees == 0
    together = accept(problem, tuple(groups))
    assert alone.gain + score(problem, groups[1], alone).gain == pytest.approx(together.gain, rel=1e-3)


def test_bounds_hold_a_coefficient_back(problem: Problem) -> None:
    """A coefficient with far bounds stays there, and has a lower gain than a free one."""
    joints, columns = problem.columns_of(Hypothesis(EFFECTS["asymmetric_friction"], 1), ())
    result = score(problem, problem.group(joints, columns), accept(problem, ()))
    free = result.coefficients()
    far = 10 * np.abs(free) + 10 * np.sqrt(np.sum(result.root**2, axis=0))
    gain, held = result.bounded(far, 2 * far)
    assert np.all(held >= far - 3.01 * np.sqrt(np.sum(result.root**2, axis=0)))
    assert gain < result.gain


def test_a_scan_on_several_cores_keeps_the_hypotheses(problem: Problem, monkeypatch: pytest.MonkeyPatch) -> None:
    """Effects are compared by identity: an entry that a forked process returns has the caller's hypothesis."""
    monkeypatch.setattr(forks, "available_cores", lambda: 2)
    given = [Hypothesis(EFFECTS["asymmetric_friction"], joint) for joint in (1, 2)] * 3
    entries = measure(problem, given)
    assert len(entries) == len(given)
    assert all(entry.hypothesis is own for entry, own in zip(entries, given, strict=True))


def test_a_coefficient_of_the_wrong_sign_explains_nothing(problem: Problem) -> None:
    """A coefficient that must be positive, but would be negative, has no gain."""
    entry = next(e for e in measure(problem, [Hypothesis(EFFECTS["asymmetric_friction"], 1)]) if e.groups)
    result = score(problem, entry.groups[0], accept(problem, ()))
    c = result.coefficients()
    one_sided = np.where(c < 0, 0.0, -np.inf), np.where(c < 0, np.inf, 0.0)
    gain, kept = result.bounded(*one_sided)
    assert gain < result.gain
    assert np.all((kept >= one_sided[0]) & (kept <= one_sided[1]))


def test_the_null_has_the_size_it_promises(problem: Problem) -> None:
    """Scores of simulated noise exceed the 90 % quantile of the chi-square distribution in 10 % of 300 draws.

    The standard error of this fraction is 1.7 %.
    """
    joints, columns = problem.columns_of(Hypothesis(EFFECTS["asymmetric_friction"], 2), ())
    group = problem.group(joints, columns)
    result = score(problem, group, accept(problem, ()))
    P, rng = problem.whitening.precision, np.random.default_rng(4)
    root, stats = np.linalg.cholesky(np.linalg.inv(P)), []
    for _ in range(300):
        noise = rng.standard_normal((problem.rows, problem.n)) @ root.T
        fitted = np.einsum("jnb,nj->b", problem.weighted_base_columns, noise)
        weighed = noise @ P
        cross = sum(part.T @ weighed[:, j] for j, part in zip(group.joints, group.columns, strict=True))
        stats.append(np.sum((result.root @ (cross - group.against @ fitted)) ** 2))
    share = float(np.mean(np.array(stats) > chi2.ppf(0.9, result.degrees)))
    assert share == pytest.approx(0.1, abs=0.07)


def test_a_log_without_effects_raises_no_alarm(problem: Problem) -> None:
    """Without an effect, the family-wise p-value of the best of some fifteen hypotheses is above 1 %."""
    names = ("asymmetric_friction", "load_dependent_friction", "friction_step", "payload_change", "spring")
    hypotheses = [
        Hypothesis(EFFECTS[name], joint) for name in names for joint in EFFECTS[name].joints(problem.situation.robot)
    ]
    result = scan(problem, measure(problem, hypotheses), accept(problem, ()))
    assert result.p_value(result.outcomes[0]) > 0.01


def test_surprise_is_the_logarithm_of_the_chi_square_tail() -> None:
    """The negative log p-value equals scipy's, and stays finite beyond scipy's range."""
    for degrees in (1, 2, 6, 16):
        for x in (0.0, 1.0, 20.0, 300.0, 1200.0):
            assert neg_log_p(x, degrees) == pytest.approx(-chi2.logsf(x, degrees), rel=0.02, abs=1e-9)
        assert 1400 < neg_log_p(3000.0, degrees) < 1510


def test_base_parameters_come_back(arm_plant: Callable[..., Plant], problem: Problem) -> None:
    """The fitted base model predicts the plant's torque within a third of its noise of 2 %."""
    plant = arm_plant()
    recording = problem.recording
    clean = plant.model.torque(recording.q, recording.dq, recording.ddq, plant.parameters)
    error = (problem.situation.torque - clean)[~recording.sign_unknown.any(axis=1)]
    assert np.all(error.std(axis=0) < 0.0067 * clean.std(axis=0))
