"""Tests of known payloads against pinocchio: their torque is subtracted from the log and added to the gears' load."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimation.diagnosis.base_models.payload_and_gravity import build_situation, subtract_known_payload
from estimation.diagnosis.recordings.log_reading import build_recording
from robots.common.errors import InputError
from robots.regressor import default_model
from robots.robot import Robot
from robots.signals import Log
from robots.terms.situations.flange_body import with_body
from tests.estimation.diagnosis.pinocchio_chains import torque_of_mass

MASS, CENTRE = 1.5, np.array([0.02, -0.03, 0.1])


def _point(mass: float, centre: np.ndarray) -> np.ndarray:
    inertia = mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    return np.array([mass, *(mass * centre), *inertia[np.triu_indices(3)]])


@pytest.fixture(scope="module")
def logs(arm: Robot, arm_log: Callable[..., Log]) -> tuple[Log, Log]:
    """Returns one log without and one with a payload, a minute apart."""
    first, second = arm_log(seed=1), arm_log(seed=2, motion_seed=1)
    start = float(first.t[-1]) + 60.0 - float(second.t[0])
    return first, replace(second, t=second.t + start, payload=_point(MASS, CENTRE))


@pytest.mark.slow
def test_a_known_payload_is_taken_off_and_felt(arm: Robot, logs: tuple[Log, Log]) -> None:
    """The torque that is subtracted and added to the rigid-body torque is pinocchio's torque of the point mass."""
    recording = build_recording(arm, logs)
    light = subtract_known_payload(arm, recording)
    run = recording.runs[1]
    expected = torque_of_mass(arm, MASS, CENTRE, recording.q[run], recording.dq[run], recording.ddq[run])
    lost = recording.tau - light.tau
    assert lost[run] == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())
    assert not lost[recording.runs[0]].any()
    model = default_model(arm)
    parameters = np.where(np.isfinite(model.nominal), model.nominal, 0.0)
    with_it = build_situation(light, model, parameters)
    without = build_situation(replace(light, payloads=()), model, parameters)
    felt = with_it.rigid - without.rigid
    assert felt[run] == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())
    assert not felt[recording.runs[0]].any()
    assert with_it.starts == without.starts
    pull = with_it.sensitivity("gravity")[run] @ np.asarray(arm.chain.gravity)
    alone = without.sensitivity("gravity")[run] @ np.asarray(arm.chain.gravity)
    still = np.zeros_like(recording.q[run])
    hanging = torque_of_mass(arm, MASS, CENTRE, recording.q[run], still, still)
    assert pull - alone == pytest.approx(hanging, abs=1e-9 * np.abs(hanging).max())
    assert with_body(model, parameters, np.zeros(10)) == pytest.approx(parameters)


@pytest.mark.parametrize("body", [np.zeros(9), -np.ones(10), np.full(10, np.nan)])
def test_a_payload_that_is_none_is_refused(logs: tuple[Log, Log], body: np.ndarray) -> None:
    """A payload needs ten finite numbers and a mass that is not negative."""
    with pytest.raises(InputError, match="payload"):
        replace(logs[0], payload=body)
