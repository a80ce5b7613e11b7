"""Tests of delays measured by the balance of impulses at reversals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from estimation import diagnose
from estimation.diagnosis.base_models.baseline import base_parameters
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.joint_agreement import per_joint_evidence
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import refine
from estimation.diagnosis.hypothesis_tests.scoring import accept, score
from estimation.diagnosis.joint_fits.shrinkage import effects_prior
from estimation.diagnosis.recordings import log_reading
from estimation.diagnosis.recordings.log_reading import build_recording
from estimation.diagnosis.recordings.recording import Recording
from estimation.diagnosis.recordings.smoothed_motion import low_pass_gain
from estimation.diagnosis.reversals.reversal_impulses import ImpulseResponse, Reversals, edges_of, impulse_columns
from estimation.diagnosis.reversals.reversal_timing import ReversalTiming, measure_reversal_timing
from estimation.diagnosis.searches.search import fit_plain
from oed.benchmarks.truth.cases import Case, draw_case
from oed.benchmarks.truth.description import write_description
from oed.benchmarks.truth.effects.actuator import Delay
from robots import load_robot
from robots.robot import Robot
from robots.signals import Log
from robots.terms.effects import EFFECTS

COUNTS = 2.0**17


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> Callable[[int, bool], tuple[Case, Robot, Log]]:
    """Draws a robot with encoders of 2^17 counts per turn, with or without a delay."""
    kept: dict[tuple[int, bool], tuple[Case, Robot, Log]] = {}

    def build(seed: int, late: bool) -> tuple[Case, Robot, Log]:
        if (seed, late) not in kept:
            case = draw_case(
                seed, hide=[Delay] if late else 0, size=0.03, kind="er3a", periodic=False, duration=60.0, unseen=0.0
            )
            folder = tmp_path_factory.mktemp(f"case{seed}{late}")
            robot = load_robot(write_description(case.machine, Path(folder)))
            count, (own,) = 2 * np.pi / COUNTS, case.logs
            kept[seed, late] = case, robot, Log(t=own.t, q=np.round(own.q_true / count) * count, tau=own.tau)
        return kept[seed, late]

    return build


@pytest.fixture(scope="module")
def recording(arm: Robot, arm_log: Callable[..., Log]) -> Recording:
    """Returns a recording of the arm without effects."""
    return build_recording(arm, [arm_log(torque_noise=0.02)])


def _timed(robot: Robot, log: Log) -> ReversalTiming:
    recording = build_recording(robot, [log])
    baseline, settled = fit_plain(base_parameters(robot, "polynomial", (0.001,) * robot.n), recording)
    timing = measure_reversal_timing(recording, baseline, settled.values, settled.residual)
    assert timing is not None
    return timing


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "late"), [pytest.param(1006, True, marks=pytest.mark.longer), (1011, True), (1011, False)]
)
def test_torque_that_is_late_is_reported_by_each_joints_reversals(cases: Callable, seed: int, late: bool) -> None:
    """Each joint's delay is within four standard errors, and their mean within three, which fails once in a thousand.

    With these encoders the reversals of low-passed motion are known to some milliseconds only.
    """
    case, robot, log = cases(seed, late)
    delay = case.effects[0].amount if late else 0.0
    timing = _timed(robot, log)
    reported = np.isfinite(timing.errors)
    assert reported.sum() >= 3
    away = (timing.lags - delay)[reported] / timing.errors[reported]
    assert np.abs(away).max() < 4.0
    weights = timing.errors[reported] ** -2
    assert abs(weights @ (timing.lags - delay)[reported]) < 3.0 * np.sqrt(weights.sum())
    # The error is at most 0.5 ms, with a sample period of 4 ms.
    assert weights.sum() ** -0.5 < 5e-4


@pytest.mark.longer
def test_a_delay_is_named_that_only_reversals_tell(cases: Callable) -> None:
    """A delay of a third of a sample is named, although no rows near reversals count."""
    case, robot, log = cases(1006, True)
    diagnosis = diagnose(robot, log, candidates=["time_delay", "thermal_friction"])
    (finding,) = diagnosis.findings
    assert finding.effect == "time_delay"
    (delay,) = (p for p in finding.parameters if p.name == "delay")
    assert delay.ci95[0] < case.effects[0].amount < delay.ci95[1]
    assert delay.ci95[1] - delay.ci95[0] < 1.5e-3
    # The estimate is the same beside the delay that was found first.
    timing = _timed(robot, log)
    assert delay.value == pytest.approx(np.average(timing.lags, weights=timing.errors**-2.0), abs=2e-4)
    (note,) = (note for note in diagnosis.notes if "time_delay" in note)
    assert "impulses at velocity reversals" in note


@pytest.mark.slow
def test_positions_that_say_too_little_of_reversals_say_nothing(cases: Callable) -> None:
    """Without position residuals, with few reversals, or without friction, no delay is measured."""
    _, robot, log = cases(1006, True)
    recording = build_recording(robot, [log])
    baseline, settled = fit_plain(base_parameters(robot, "polynomial", (0.001,) * robot.n), recording)
    assert (
        measure_reversal_timing(replace(recording, position_residual=None), baseline, settled.values, settled.residual)
        is None
    )
    friction = [i for i, column in enumerate(baseline.base.columns) if column.symbol == "f1" and column.joint == 2]
    values = settled.values.copy()
    values[friction] = 0.0
    timing = measure_reversal_timing(recording, baseline, values, settled.residual)
    assert timing is not None
    assert np.isinf(timing.errors[1])
    once = recording.dq.copy()
    once[:, 0] = np.abs(once[:, 0]) + 1e-6
    timing = measure_reversal_timing(replace(recording, dq=once), baseline, settled.values, settled.residual)
    assert timing is not None
    assert np.isinf(timing.errors[0])


def test_reversals_at_a_row_are_within_their_table(recording: Recording) -> None:
    """A reversal exactly at a row, whose table ends exactly at rows on both sides, has all rows but the last."""
    step = recording.step
    cutoff = 0.04 / step
    tables = [ImpulseResponse.of(cutoff, step, edges_of(cutoff, step))]
    reach = tables[0].x[-1] / step
    assert reach == round(reach)
    one = np.array([300.0])
    turns = Reversals(one, np.ones(1), np.zeros(1, dtype=np.intp), np.zeros(1, dtype=np.intp), np.ones(1))
    columns, _, away = impulse_columns(recording, turns, one, tables)
    expected = tables[0].at((np.arange(len(recording)) - 300.0) * step)
    rows = np.isfinite(away)
    assert rows.sum() == 2 * reach
    for column, part in zip(columns, expected, strict=True):
        np.testing.assert_allclose(column[rows], part[rows], atol=1e-9 * np.abs(part).max())


@pytest.mark.slow
@pytest.mark.parametrize(("cutoff", "step"), [(5.0, 0.004), (20.0, 0.004), (40.0, 0.01), (60.0, 0.001)])
def test_a_table_is_the_motion_of_a_force_that_a_loop_undoes(cutoff: float, step: float) -> None:
    """The tabulated acceleration integrates to velocity and position, with little energy in the passed band."""
    edges = edges_of(cutoff, step)
    table = ImpulseResponse.of(cutoff, step, edges)
    dx = table.x[1] - table.x[0]
    position, velocity, acceleration = table.values
    # At the start of a force, the error of finite differences is one step's change.
    off = dx * np.abs(acceleration).max()
    assert np.gradient(position, dx, axis=0)[1:-1] == pytest.approx(velocity[1:-1], abs=off)
    summed = np.cumsum(acceleration, axis=0) * dx
    assert summed - summed[0] == pytest.approx(velocity - velocity[0], abs=2.0 * off)
    assert len(edges) >= 4
    assert acceleration.shape[1] == 2 * (len(edges) - 1) - 2
    # The table is interpolated linearly, at single times as in a series of samples.
    assert table.at(table.x[5:6] + dx / 2)[0] == pytest.approx((position[5:6] + position[6:7]) / 2)
    first, count = table.x[0] + 0.3 * dx, int((table.x[-1] - table.x[0]) / step)
    whole = table.at(first + step * np.arange(count))
    assert table.sampled(first, count) == pytest.approx(whole, abs=1e-9 * np.abs(whole).max())
    # Its spectrum has little energy in the band that passes.
    f = np.fft.rfftfreq(len(table.x), dx)
    power = np.abs(np.fft.rfft(position, axis=0)) ** 2
    slow = low_pass_gain(f, cutoff) > 0.99
    assert power[slow].sum() < 0.05 * power.sum()


def test_joints_whose_rows_count_are_timed_where_that_tells_far_more(recording: Recording) -> None:
    """A joint whose rows near reversals count is timed only if that is far more accurate, so no data count twice."""
    timing = ReversalTiming(np.array([1e-3, 1e-3]), np.array([2e-4, 2e-4]), np.zeros(2))
    everywhere = np.ones(recording.q.shape, dtype=bool)
    for late, kept in ((1e-3, [True, True]), (1e-4, [False, True])):
        counting = replace(
            recording,
            sign_known_from_velocity=everywhere,
            trusted=np.array([True, False]),
            reversal_time_error=np.full(recording.q.shape, late),
        )
        reported = timing.beside(counting)
        assert reported is not None
        np.testing.assert_array_equal(np.isfinite(reported.errors), kept)
        np.testing.assert_array_equal(reported.residual[~np.array(kept)], 0.0)
    both = replace(
        recording,
        sign_known_from_velocity=everywhere,
        trusted=np.ones(2, dtype=bool),
        reversal_time_error=np.zeros(recording.q.shape),
    )
    assert timing.beside(both) is None


@pytest.mark.slow
def test_what_reversals_tell_counts_as_one_row_for_each_joint(
    pose_arm: Callable[..., Problem], recording: Recording
) -> None:
    """Reversal timing adds 1 / s^2 and d / s^2 per joint to a delay's products, and nothing to other effects."""
    plain = pose_arm(recording)
    timing = ReversalTiming(np.array([2e-3, 3e-3]), np.array([5e-4, np.inf]), np.zeros(2))
    problem = replace(plain, timing=timing)
    for name, joint in (("time_delay", None), ("current_lag", 1), ("spring", 1)):
        hypothesis = Hypothesis(EFFECTS[name], joint)
        shape = {"time_delay": (1e-3,), "current_lag": (1e-3,)}.get(name, (0.0, 0.0, 3.0))
        before, after = (p.measured(hypothesis, shape) for p in (plain, problem))
        squares, product = (4e6, 2e-3 * 4e6) if name == "time_delay" else (0.0, 0.0)
        assert after.gram == pytest.approx(before.gram + squares)
        assert after.cross == pytest.approx(before.cross + product)
        assert problem.product(after, after) == pytest.approx(after.gram, rel=1e-4)
    delay = Hypothesis(EFFECTS["time_delay"], None)
    reported = [per_joint_evidence(p, delay, (2e-3,), accept(p, ())) for p in (plain, problem)]
    assert reported[1].gram - reported[0].gram == pytest.approx([4e6, 0.0], abs=1e-3 * reported[0].gram.max())
    # The fitted coefficient, and the prior on it, are those of rows and reversals together.
    member = refine(problem, delay, (2e-3,), accept(problem, ()))
    rows = score(plain, plain.measured(delay, member.shape), accept(plain, ()))
    both = float((rows.cross + 2e-3 * 4e6)[0] / (rows.gram[0, 0] + 4e6))
    assert member.coefficients[0] == pytest.approx(both, rel=1e-6)
    pull = effects_prior(problem, [member])
    assert pull.precision[-1, -1] * pull.target[-1] == pytest.approx(problem.whitening.row_weight * 2e-3 * 4e6)
    assert 0.0 < pull.target[-1] <= 2e-3


@pytest.mark.slow
def test_reversals_of_a_thinned_log_are_timed_by_all_its_samples(
    cases: Callable, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Reversals of a thinned log are timed at full rate, with the same delays."""
    case, robot, log = cases(1006, True)
    plain = _timed(robot, log)
    monkeypatch.setattr(log_reading, "MOST_ROWS", 8000)
    recording = build_recording(robot, [log])
    assert recording.full_rate is not None
    assert recording.step == pytest.approx(2 * recording.full_rate.step)
    thinned = _timed(robot, log)
    reported = np.isfinite(thinned.errors)
    assert reported.sum() >= 3
    assert np.abs((thinned.lags - case.effects[0].amount) / thinned.errors)[reported].max() < 4.0
    both = reported & np.isfinite(plain.errors)
    # The base model is fitted to half of the rows, so the width of its sign may differ by chance.
    assert np.all(np.abs(thinned.lags - plain.lags)[both] < np.hypot(plain.errors, thinned.errors)[both])
    monkeypatch.setattr(log_reading, "MOST_FINE", 10_000)
    assert build_recording(robot, [log]).full_rate is None
