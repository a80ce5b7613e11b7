"""Tests of the diagnosis of logs under two gravities, against pinocchio."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from estimation import load_model, predict
from estimation.diagnosis import Diagnosis, diagnose
from estimation.diagnosis.base_models.baseline import base_parameters, build_baseline
from estimation.diagnosis.base_models.payload_and_gravity import build_situation, subtract_known_payload
from estimation.diagnosis.recordings.log_reading import build_recording
from estimation.diagnosis.simulations.forward_simulation import FittedRobot
from robots.common.errors import InputError
from robots.regressor import default_model
from robots.robot import Robot
from robots.signals import Log, Motion
from robots.terms.situations.flange_body import point_mass

pytestmark = pytest.mark.slow

ANGLE = np.radians(15.0)
TILTED = 9.81 * np.array([0.0, -np.sin(ANGLE), -np.cos(ANGLE)])
MASS, CENTRE = 1.5, (0.02, -0.03, 0.1)
WIDTH = 1e-3  # [rad/s] of the sign
SOME = ("torque_constant_error", "base_tilt", "spring", "payload_change", "friction_step")
SIMPLE = "coulomb-viscous"
Torque = Callable[..., np.ndarray]
Build = Callable[..., Log]


@pytest.fixture(scope="module")
def build(upright: Robot, fourier_motion: Callable[..., Motion], pinocchio_torque: Torque) -> Build:
    """Builds a log with pinocchio's torque, with a gain per drive and an unknown tilt of the base."""

    def make(
        seed: int,
        gravity: np.ndarray | None = None,
        mass: float = 0.0,
        gain: tuple[float, ...] = (1.0, 1.0, 1.0),
        askew: tuple[float, ...] = (0.0, 0.0, 0.0),
    ) -> Log:
        motion = fourier_motion(upright, seed, period=0.008)
        field = pin.exp3(-np.array(askew)) @ (upright.chain.gravity if gravity is None else gravity)
        f = upright.friction
        tau = f[:, 0] * np.tanh(motion.dq / WIDTH) + f[:, 1] * motion.dq + upright.rotor_inertia * motion.ddq
        tau = (tau + pinocchio_torque(upright, motion, field, mass, CENTRE)) * gain
        tau = tau + 0.02 * np.random.default_rng(seed).normal(size=tau.shape)
        payload = point_mass(mass, CENTRE) if mass else None
        return Log(t=motion.t + 100.0 * seed, q=motion.q, tau=tau, gravity=gravity, payload=payload)

    return make


def test_each_log_is_evaluated_as_its_base_stood(upright: Robot, build: Build, pinocchio_torque: Torque) -> None:
    """Columns, situations and the simulated robot use each log's own gravity and payload."""
    logs = (build(0), build(1, TILTED, MASS), build(2, TILTED))
    recording = build_recording(upright, logs)
    light = subtract_known_payload(upright, recording)
    base = base_parameters(upright, SIMPLE, (WIDTH,) * 3, [TILTED])
    baseline = build_baseline(base, light)
    parameters = np.array(base.model.nominal)
    values = base.from_standard(parameters)
    now = build_situation(light, baseline.base.model, parameters)
    plant = FittedRobot(model=baseline.base.model, columns=base.independent, values=values)
    for run, log in zip(recording.runs, logs, strict=True):
        motion = Motion(recording.t[run], recording.q[run], recording.dq[run], recording.ddq[run])
        bare = pinocchio_torque(upright, motion, log.gravity)
        full = pinocchio_torque(upright, motion, log.gravity, MASS if log.payload is not None else 0.0, CENTRE)
        size = 1e-9 * np.abs(full).max()
        assert (recording.tau - light.tau)[run] == pytest.approx(full - bare, abs=size)
        rotors = upright.rotor_inertia * motion.ddq
        assert now.rigid[run] == pytest.approx(full + rotors, abs=size)
        own = [i for i, column in enumerate(base.columns) if column.term == "rigid_body"]
        # Some rotors are grouped with their links.
        rigid = np.where([c.term in ("rigid_body", "rotor_inertia") for c in base.model.columns], parameters, 0.0)
        grouped = base.from_standard(rigid)
        assert baseline.regressor[run] @ grouped == pytest.approx(bare + rotors, abs=size)
        assert len(own) > 0
        part = replace(
            light,
            t=light.t[run],
            starts=(0,),
            q=light.q[run],
            dq=light.dq[run],
            ddq=light.ddq[run],
            payloads=(light.bodies[recording.runs.index(run)],),
            gravity_fields=(light.gravities[recording.runs.index(run)],),
        )
        states = (part.q, part.dq, part.ddq)
        # The plant also has friction and the payload.
        carried = plant.payload_torque(part, states)
        assert carried == pytest.approx(full - bare, abs=size)
        assert plant.base(part, states) - carried == pytest.approx(baseline.regressor[run] @ values, abs=1e-6)
        assert plant.at(part, states).sensitivity("gravity") == pytest.approx(now.sensitivity("gravity")[run], abs=1e-5)
    assert now.robot is upright
    assert now.gravity[recording.runs[1]] == pytest.approx(
        np.broadcast_to(TILTED, (len(light.t[recording.runs[1]]), 3))
    )


@pytest.fixture(scope="module")
def gained(upright: Robot, build: Build) -> tuple[Diagnosis, tuple[Log, Log]]:
    """Returns the diagnosis of an arm whose shoulder torque is logged 4 % too large, from a level and a tilted log."""
    gain = (1.0, 1.04, 1.0)
    logs = (build(0, gain=gain), build(1, TILTED, gain=gain))
    return diagnose(upright, logs, candidates=SOME, friction=SIMPLE), logs


def test_a_wrong_torque_constant_is_told_from_a_tilt_and_a_mass(gained: tuple[Diagnosis, tuple[Log, Log]]) -> None:
    """With logs under two gravities, a wrong torque constant is named with joint and size."""
    result, _ = gained
    assert result.verdict == "named"
    (finding,) = result.findings
    assert (finding.effect, finding.joint) == ("torque_constant_error", 2)
    (error,) = finding.parameters
    assert abs(error.value) == pytest.approx(0.04, abs=0.01)
    assert result.extended[1] < result.baseline[1]


def test_the_extended_model_predicts_on_the_base_as_described_and_as_tilted(
    gained: tuple[Diagnosis, tuple[Log, Log]], build: Build, tmp_path: Path
) -> None:
    """The loaded model predicts logs under both gravities, and with a payload."""
    result, _ = gained
    result.save(tmp_path)
    model = load_model(tmp_path)
    assert model.gravities == (tuple(TILTED),)
    assert {"mPx_1", "mPy_1"} <= set(model.names)
    gain = (1.0, 1.04, 1.0)
    for log in (build(3, gain=gain), build(4, TILTED, gain=gain), build(5, TILTED, MASS, gain=gain)):
        # Noise is 0.02 N m of some 2 to 15 N m; the rest are smoothing errors at reversals.
        assert np.all(predict(model, log).nrmse < 0.03)


@pytest.mark.longer
def test_a_tilt_that_was_not_told_is_not_taken_for_nothing(upright: Robot, build: Build) -> None:
    """With the known tilt, logs predict each other to the noise; without it, the gate states the gravity that fits.

    Without the gate, errors are large.
    """
    logs = (build(0), build(1, TILTED))
    told = diagnose(upright, logs, candidates=SOME, friction=SIMPLE)
    assert told.verdict == "none"
    unstated = [logs[0], replace(logs[1], gravity=None)]
    with pytest.raises(InputError, match="--gravity") as refused:
        diagnose(upright, unstated, candidates=SOME, friction=SIMPLE)
    stated = [float(v) for v in re.search(r"--gravity K=([-.0-9,]+) ", str(refused.value))[1].split(",")]
    # The arm's own parameters are 20 % off, so the direction is known to some degrees.
    assert stated == pytest.approx(TILTED, abs=0.7)
    untold = diagnose(upright, unstated, candidates=SOME, friction=SIMPLE, check=False)
    assert np.all(np.array(told.baseline) < 0.05)
    assert max(untold.baseline) > 0.3


def test_a_base_askew_on_its_mount_is_found_under_two_gravities(upright: Robot, build: Build) -> None:
    """An unknown base tilt is found from logs under two gravities, with angles to 0.1 degrees."""
    askew = (0.03, -0.02, 0.0)
    logs = (build(0, askew=askew), build(1, TILTED, askew=askew))
    result = diagnose(upright, logs, held_out=build(2, TILTED, askew=askew), candidates=SOME, friction=SIMPLE)
    finding = result.findings[0]
    assert finding.effect == "base_tilt"
    assert [p.value for p in finding.parameters[:2]] == pytest.approx(askew[:2], abs=2e-3)
    assert finding.gain is not None
    assert finding.gain.ci95[0] > 0


def test_what_only_a_tilt_shows_of_an_upright_axis_is_no_spring(upright: Robot, build: Build) -> None:
    """First moments about the vertical first axis are fitted with the tilt, and not named as a spring."""
    askew = (0.02, 0.015, 0.0)
    candidates = ("base_tilt", "spring", "torque_constant_error", "torque_ripple")
    result = diagnose(upright, build(0, askew=askew), candidates=candidates, friction=SIMPLE)
    (finding,) = result.findings
    assert finding.effect == "base_tilt"
    told = {parameter.name: parameter.value for parameter in finding.parameters}
    assert (told["tilt_1"], told["tilt_2"]) == pytest.approx(askew[:2], abs=3e-3)
    # The first moments of the waist, and those of 6 kg on its lever.
    assert (told["own_moment_1"], told["own_moment_2"]) == pytest.approx((0.3 + 0.1 * 6, 0.2), abs=0.15)


def test_unseen_logs_may_stand_as_none_before(upright: Robot, build: Build) -> None:
    """A model fitted on a level base predicts a tilted one, with the description's values where only a tilt shows."""
    result = diagnose(upright, build(0), held_out=build(1, TILTED), candidates=SOME, friction=SIMPLE)
    assert result.verdict == "none"
    assert np.all(np.array(result.baseline) < 0.05)


def test_the_default_model_is_one_object_a_gravity(upright: Robot) -> None:
    """The default model is cached per gravity."""
    model = default_model(upright)
    assert model.under(TILTED) is model.under(tuple(TILTED))
    assert model.under(None) is model.under(upright.chain.gravity) is model
