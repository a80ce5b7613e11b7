"""Tests of gear compliance measured by encoders on both sides of a gear."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

from estimation.diagnosis import Diagnosis, diagnose
from estimation.diagnosis.base_models.baseline import base_model_prior, base_parameters, build_baseline
from estimation.diagnosis.recordings.log_reading import build_recording
from estimation.diagnosis.validations.gear_compliance import MeasuredCompliance, measure_gear_compliance
from robots.plants import simulate
from robots.robot import Robot
from robots.signals import Log

COMPLIANCE, DELAY, MOTION = 2e-4, 0.003, 2e-4


def with_encoders(log: Log, compliance: np.ndarray, seed: int) -> Log:
    """Adds link encoders to a log, with deflection, lost motion, a delay of 3 ms, eccentricity and noise."""
    rng = np.random.default_rng(seed)
    t, q = log.t, log.q
    dq = np.gradient(q, t, axis=0)
    friction = np.array([2.0, 1.0]) * np.tanh(dq / 1e-3) + np.array([1.5, 0.8]) * dq
    # The gear load is the drive's torque minus friction and rotor torque.
    load = log.tau - friction - np.array([0.2, 0.1]) * np.gradient(dq, t, axis=0)
    link = q - compliance * load - MOTION / 2 * np.sign(dq) * (compliance > 0)
    late = CubicSpline(t, link)(t - DELAY)
    wrong = 1e-4 * np.sin(q + 0.7)
    drift = lfilter([np.sqrt(1 - 0.99**2)], [1, -0.99], rng.standard_normal(q.shape), axis=0)
    return replace(log, qlink=late + wrong + 2e-5 * drift + 1e-5 * rng.standard_normal(q.shape))


def found_in(robot: Robot, log: Log, **options: object) -> tuple[MeasuredCompliance, ...]:
    """Measures the gear compliance with a fit of the base model only."""
    recording = build_recording(robot, [log])
    base = build_baseline(base_parameters(robot, "coulomb-viscous", (0.001,) * robot.n), recording)
    weights = ~recording.sign_unknown / recording.tau.std(axis=0)
    values = base.fitted(weights, recording.tau, base_model_prior(base, recording))
    return measure_gear_compliance(base.situation(recording, values), recording, [log], false_alarm=0.01, **options)


@pytest.mark.slow
def test_the_stiffness_of_a_gear_is_measured(arm: Robot, arm_plant: Callable, fourier_motion: Callable) -> None:
    """Compliance, delay and lost motion are within 3.5 standard errors, on the elastic joint only.

    The chance that one of the three is not is 2 %, with ten blocks.
    """
    log = simulate(arm_plant(torque_noise=0.02), fourier_motion(arm, 2, duration=40.0))
    (windup,) = found_in(arm, with_encoders(log, np.array([COMPLIANCE, 0.0]), 1))
    finding = windup.finding
    assert (finding.effect, finding.joint, finding.measured_by) == ("joint_elasticity", 1, "qlink")
    values = {p.name: p for p in finding.parameters}
    for name, truth in (("compliance", COMPLIANCE), ("encoder_delay", DELAY), ("lost_motion", MOTION)):
        assert abs(values[name].value - truth) < 3.5 * values[name].standard_error, name
        assert values[name].determined, name
    # Accurate to 3 %: 40 s with a load of 15 N m RMS and a noise of some 30 urad.
    assert values["compliance"].value == pytest.approx(COMPLIANCE, rel=0.03)
    assert finding.gain.ci95[0] > 0
    assert finding.gain.nrmse_after < 0.2 * finding.gain.nrmse_before
    assert "measured by its two encoders" in finding.sentence
    assert "3.0" in finding.sentence
    assert windup.extension.coefficients == pytest.approx([COMPLIANCE], rel=0.03)
    assert np.std(windup.after) < 0.2 * np.std(windup.before)


@pytest.mark.slow
def test_stiff_gears_raise_no_alarm(arm: Robot, arm_plant: Callable, fourier_motion: Callable) -> None:
    """At most two of 30 robots with stiff gears and inaccurate encoders are called elastic.

    With 1 % per robot, 0.3 are expected; three or more have a chance of 1 in 300.
    """
    alarms = 0
    for seed in range(30):
        log = simulate(arm_plant(torque_noise=0.02), fourier_motion(arm, seed, duration=12.0), seed=seed)
        alarms += bool(found_in(arm, with_encoders(log, np.zeros(2), seed)))
    assert alarms <= 2


@pytest.mark.slow
def test_intervals_hold(arm: Robot, arm_plant: Callable, fourier_motion: Callable) -> None:
    """In at least 16 of 20 short logs the 95 % interval of the compliance contains the true value.

    19 are expected; fewer than 16 have a chance of 1 in 400.
    """
    held = 0
    for seed in range(20):
        log = simulate(arm_plant(torque_noise=0.02), fourier_motion(arm, seed + 100, duration=12.0), seed=seed)
        found = found_in(arm, with_encoders(log, np.array([COMPLIANCE, 0.0]), seed))
        first = next(windup.finding for windup in found if windup.finding.joint == 1)
        low, high = first.parameters[0].ci95
        held += low < COMPLIANCE < high
    assert held >= 16


@pytest.fixture(scope="module")
def twisted(arm: Robot, arm_plant: Callable, fourier_motion: Callable) -> Diagnosis:
    """Returns the diagnosis of an arm with a link encoder on its first joint only, with a held-out log."""
    logs = []
    for seed in (0, 1):
        log = simulate(arm_plant(torque_noise=0.02), fourier_motion(arm, seed), seed=seed)
        log = with_encoders(log, np.full(2, COMPLIANCE), seed)
        qlink = log.qlink.copy()
        qlink[:, 1] = np.nan
        logs.append(replace(log, qlink=qlink, t=log.t + 100.0 * seed))
    return diagnose(arm, logs[0], held_out=logs[1], candidates=("stribeck", "spring"), friction="coulomb-viscous")


@pytest.mark.slow
def test_a_diagnosis_says_what_the_encoders_measured(twisted: Diagnosis, tmp_path: object) -> None:
    """The elastic gear is named with its held-out gain and added to the model, and the result can be loaded."""
    assert twisted.verdict == "named"
    (finding,) = [f for f in twisted.findings if f.measured_by]
    assert finding.joint == 1
    assert finding.gain.nrmse_after < 0.3 * finding.gain.nrmse_before
    assert "% of the wind-up" in twisted.summary()
    assert [(e.effect, e.joint) for e in twisted.model.extensions if e.effect == "joint_elasticity"] == [
        ("joint_elasticity", 1)
    ]
    twisted.save(tmp_path)  # type: ignore[arg-type]
    again = Diagnosis.load(tmp_path)  # type: ignore[arg-type]
    assert again.to_dict() == twisted.to_dict()


@pytest.mark.slow
def test_without_encoders_nothing_is_measured(arm: Robot, arm_plant: Callable, fourier_motion: Callable) -> None:
    """A log without link positions gives no measured compliance."""
    assert found_in(arm, simulate(arm_plant(), fourier_motion(arm, 2))) == ()
