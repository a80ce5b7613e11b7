"""Tests of gains when logs differ in noise, and of hand guiding on a real pendulum."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from estimation import diagnose, on_one_clock, read_log
from estimation.diagnosis.calibration import LARGE_HELD_OUT_ERROR
from estimation.diagnosis.hypothesis_tests.groups import Group
from estimation.diagnosis.noise_models.noise_estimate import estimate_whitening
from estimation.diagnosis.recordings.log_reading import Recording
from estimation.diagnosis.searches.log_noise_levels import PASSED, profile_gain
from robots import load_robot

STEP = 0.004


def test_the_profile_is_that_of_least_squares_with_a_level_for_each_log():
    """The profile gain is sum N_r log(E_r / E_r') with the squared residuals of each log from plain least squares."""
    rng = np.random.default_rng(0)
    runs = (slice(0, 400), slice(400, 1000))
    base = np.linalg.qr(rng.standard_normal((1000, 5)))[0]
    effect = np.zeros(1000)
    effect[runs[1]] = np.sin(np.arange(600) / 20)
    noise = rng.standard_normal(1000)
    noise[runs[1]] *= 0.01
    y = base @ [3.0, -1.0, 2.0, 0.5, 1.0] + 0.8 * effect + noise
    without, (*_, c) = y - base @ (base.T @ y), np.linalg.lstsq(np.column_stack([base, effect]), y, rcond=None)[0]
    leftover = effect - base @ (base.T @ effect)
    group = Group((0,), (effect[:, None].astype(np.float32),), effect[None] @ base, np.eye(1), np.ones(1), np.ones(1))
    problem = SimpleNamespace(
        whitening=SimpleNamespace(precision=np.eye(1), weights=None, stride=1),
        weighted_base_columns=base[None],
        white=without[:, None],
        rows=1000,
        n=1,
        recording=SimpleNamespace(runs=runs),
    )
    member = SimpleNamespace(group=group, coefficients=np.array([c]))
    counted = [PASSED * 400 * (1 - 5 / (PASSED * 1000)), PASSED * 600 * (1 - 5 / (PASSED * 1000))]
    after = without - c * leftover
    expected = sum(
        k * np.log((without[r] ** 2).sum() / (after[r] ** 2).sum()) for k, r in zip(counted, runs, strict=True)
    )
    assert profile_gain(problem, member) == pytest.approx(expected, rel=1e-5)
    # With one noise level for both logs, the gain would be negligible.
    assert expected > 1000


def test_logs_have_levels_of_their_own():
    """A log with a tenth of the noise is whitened to unit level like the others."""
    rng = np.random.default_rng(1)
    rows = 5000
    residual = rng.standard_normal((2 * rows, 2)) * [1.0, 3.0]
    residual[rows:] *= 0.1
    zero = np.zeros_like(residual)
    recording = Recording(
        t=STEP * np.arange(2 * rows),
        starts=(0, rows),
        q=zero,
        dq=zero,
        ddq=zero,
        tau=zero,
        step=STEP,
        cycles=(None, None),
        cutoff=50.0,
        floor=np.full(2, 1e-20),
        sign_unknown=zero.astype(bool),
        sign_known_from_velocity=zero.astype(bool),
        reversal_acceleration_error=np.zeros(2),
        names=("one", "two"),
    )
    whitening = estimate_whitening(recording, residual, 0, np.eye(2))
    assert whitening.levels[0] / whitening.levels[1] == pytest.approx([10.0, 10.0], rel=0.15)
    white = replace(whitening, weights=None).all(residual)
    half = len(white) // 2
    # Each has some 1600 frequencies in the band: the standard error of their mean power is 2.5 %.
    assert white[:half].std(axis=0) == pytest.approx(white[half:].std(axis=0), rel=0.15)


@pytest.mark.slow
def test_a_hand_that_moved_the_arm_is_found(data):
    """In three runs of a pendulum, hand guiding in the third is named, with its time."""
    folder = data("simple_pendulum_dfki")
    logs = on_one_clock([read_log(folder / f"{name}.parquet") for name in ("ddp", "dircol", "gravity_comp")])
    candidates = ("hand_guiding", "external_contact", "friction_step", "payload_change", "encoder_offset")
    said = diagnose(load_robot(folder / "simple_pendulum.urdf", unlimited=True), logs, candidates=candidates)
    assert said.verdict == "named"
    (finding,) = said.findings
    assert finding.effect == "hand_guiding"
    times = {parameter.name: parameter.value for parameter in finding.parameters}
    # The hand acted during most of the third run.
    assert times["start"] > logs[1].t[-1]
    assert times["end"] <= logs[2].t[-1] + 1.0
    assert times["end"] - times["start"] > 0.7 * logs[2].duration
    assert finding.gain.ci95[0] > 0.0
    assert finding.gain.nrmse_after < 0.6 * finding.gain.nrmse_before


@pytest.mark.longer
def test_logs_that_contradict_each_other_are_not_passed_over(data):
    """Two short runs that contradict each other give a note, whatever the verdict."""
    folder = data("simple_pendulum_dfki")
    logs = on_one_clock([read_log(folder / f"{name}.parquet") for name in ("dircol", "gravity_comp")])
    said = diagnose(load_robot(folder / "simple_pendulum.urdf", unlimited=True), logs)
    assert said.baseline[0] > LARGE_HELD_OUT_ERROR
    assert said.verdict != "none" or any("differ in something" in note for note in said.notes)
