"""Tests of effects by changes of acceleration, near reversals and elsewhere."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimation.diagnosis.calibration import MAX_HIGH_BAND_ERROR, REVERSAL_MARGIN
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import _reversal_scatter
from estimation.diagnosis.hypothesis_tests.scoring import accept, score
from estimation.diagnosis.recordings.log_reading import build_recording
from estimation.diagnosis.recordings.recording import Recording
from estimation.diagnosis.reversals.reversal_impulses import find_reversals
from robots.plants import simulate
from robots.robot import Robot
from robots.signals import Log, Motion
from robots.terms.effects import EFFECTS

ELASTIC, PLAY = Hypothesis(EFFECTS["joint_elasticity"], 2), Hypothesis(EFFECTS["backlash"], 2)


@pytest.fixture(scope="module")
def recording(arm: Robot, arm_log: Callable[..., Log]) -> Recording:
    """Returns a recording of the arm without effects."""
    return build_recording(arm, [arm_log(torque_noise=0.02)])


@pytest.fixture(scope="module")
def problem(recording: Recording, pose_arm: Callable[..., Problem]) -> Problem:
    """Returns the whitened problem with the frequencies above its bands."""
    return pose_arm(replace(recording, floor=np.full(2, 1e-11), cycles=(None,)), wider=MAX_HIGH_BAND_ERROR)


def _elastic(problem: Problem) -> FittedEffect:
    shape = ELASTIC.effect.grid(problem.situation, 2)[-1]
    group = problem.measured(ELASTIC, shape)
    return FittedEffect(ELASTIC, shape, group, 100.0, np.array([10.0 / np.sqrt(group.gram[0, 0])]), 1, 1.0)


def _with(problem: Problem, member: FittedEffect, calm: float, beside: float) -> Problem:
    """Returns the data of an effect with given sizes far from and near reversals, and nothing else."""
    return _sized(problem, member, np.where(problem.far_from_reversals, calm, beside))


def _sized(problem: Problem, member: FittedEffect, sizes: np.ndarray) -> Problem:
    """Returns the data of an effect with a given size in each whitened row (N,), and nothing else."""
    white = np.zeros_like(problem.white)
    for j, part in zip(member.group.joints, member.group.columns, strict=True):
        white[:, j] = sizes * (part @ member.coefficients)
    own = white @ problem.whitening.precision
    base = sum(problem.weighted_base_columns[j].T @ white[:, j] for j in range(problem.n))
    # Subtract the projection on the base model, because <Q, r> is zero for a residual.
    return replace(problem, residual=own - np.einsum("jnb,b->nj", problem.weighted_base_columns, base))


def test_rows_beside_reversals_and_the_ends_of_rests_are_not_calm(recording: Recording) -> None:
    """A reversal disturbs all joints for 50 ms before and after it; rows within a rest are undisturbed."""
    unsure = np.zeros_like(recording.sign_unknown)
    unsure[300:304, 0] = True
    unsure[1000:1400, 1] = True
    reach = round(REVERSAL_MARGIN / recording.step)
    disturbed = np.zeros(len(recording), dtype=bool)
    for first, last in ((300, 303), (1000, 1000), (1399, 1399)):
        disturbed[first - reach : last + reach + 1] = True
    known = replace(recording, sign_unknown=unsure)
    np.testing.assert_array_equal(known.far_from_reversals(), ~disturbed)
    np.testing.assert_array_equal(known.far_from_reversals(3), ~disturbed[::3])


@pytest.mark.slow
def test_reversals_of_one_motion_in_several_logs_are_of_one_kind(
    arm: Robot, arm_plant: Callable, fourier_motion: Callable[..., Motion], pose_arm: Callable[..., Problem]
) -> None:
    """A repeated motion has the kinds of reversals of one log, and another motion adds its own."""
    plant = arm_plant(torque_noise=0.02)

    def kinds(*motions: int) -> int:
        logs = [simulate(plant, fourier_motion(arm, m, duration=20.0), seed=k) for k, m in enumerate(motions)]
        problem = pose_arm(build_recording(arm, [replace(log, t=log.t + 40.0 * k) for k, log in enumerate(logs)]))
        base = problem.baseline.base
        turns = find_reversals(problem.recording, 0, base, problem.situation.parameters[list(base.independent)])
        assert turns is not None
        return len(np.unique(turns.kind))

    assert kinds(3, 3, 3) == kinds(3)
    assert kinds(3, 4) == kinds(3) + kinds(4)


def test_the_parts_of_a_torque_are_the_whole(problem: Problem) -> None:
    """Rows far from and near reversals have together the products of the whole group."""
    member = _elastic(problem)
    parts = problem.split(member.group, member.coefficients, problem.far_from_reversals)
    assert parts.cross.sum() == pytest.approx(float(member.coefficients @ member.group.cross), rel=1e-4)
    energy = float(member.coefficients @ member.group.gram @ member.coefficients)
    assert parts.gram.sum() == pytest.approx(energy, rel=1e-4)
    assert (np.diag(parts.gram) > 0).all()


@pytest.mark.parametrize("size", [0.5, 1.0, 1.3])
def test_an_effect_that_is_alike_everywhere_counts_whole(problem: Problem, size: float) -> None:
    """An effect of equal size in all rows counts in full."""
    member = _elastic(problem)
    assert _reversal_scatter(_with(problem, member, size, size), member, accept(problem, ())) == 1.0


def test_kicks_without_the_rest_are_no_effect(problem: Problem) -> None:
    """An effect that shows near reversals only is rejected; one with unequal sizes counts less."""
    member = _elastic(problem)
    nothing = accept(problem, ())
    parts = score(problem, problem.split(member.group, member.coefficients, problem.far_from_reversals), nothing)
    assert parts.gram.sum(axis=1)[0] ** 2 / parts.gram[0, 0] > 20, "calm rows show too little for this test"
    assert _reversal_scatter(_with(problem, member, -0.2, 1.0), member, nothing) == np.inf
    assert 1.0 < _reversal_scatter(_with(problem, member, 0.55, 2.0), member, nothing) < np.inf


def test_above_the_bands_play_counts_in_calm_rows(problem: Problem) -> None:
    """Above the bands, the columns of backlash are zero near reversals before the projection off the base model."""
    assert problem.high_band is not None
    upper = problem.high_band
    series = problem.columns_of(PLAY, PLAY.effect.grid(problem.situation, 2)[0])[1][1]
    whole, calm = upper.columns(series, 1), upper.columns(series, 1, calm=True)
    own = upper.joints[1]
    assert own is not None
    np.testing.assert_allclose(own.base.T @ calm, 0.0, atol=1e-9 * np.linalg.norm(whole))
    assert not upper.far_from_reversals.all()

    def left(columns: np.ndarray) -> float:
        """Computes the fraction of columns near reversals that no combination of base columns there explains."""
        there, base = columns[~upper.far_from_reversals], own.base[~upper.far_from_reversals]
        return float(np.linalg.norm(there - base @ np.linalg.lstsq(base, there)[0]) / np.linalg.norm(there))

    # Near reversals only the projection on the base model is left.
    assert left(calm) < 1e-9
    assert left(whole) > 0.1


def test_an_extension_is_fitted_in_the_rows_it_was_found_in(problem: Problem) -> None:
    """Above the bands, backlash is fitted far from reversals, and a ripple in all rows."""
    assert problem.high_band is not None
    play = problem.columns_of(PLAY, PLAY.effect.grid(problem.situation, 2)[0])[1][1]
    ripple = np.cos(40.0 * problem.recording.q[:, 1:])
    columns = np.zeros((len(play), 2, 2))
    columns[:, 1] = np.column_stack([play[:, 0], ripple[:, 0]])
    rows, torque = problem.high_band.regression(columns, calm=np.array([True, False]))
    np.testing.assert_array_equal(rows[:, :1], problem.high_band.columns(play[:, :1], 1, calm=True))
    np.testing.assert_array_equal(rows[:, 1:], problem.high_band.columns(ripple, 1))
    assert len(torque) == len(rows)
