"""Tests of logs that no base model explains."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from estimation import diagnose
from estimation.diagnosis.base_models.baseline import base_parameters
from estimation.diagnosis.base_models.prepared_logs import find_unusable_logs
from estimation.diagnosis.recordings.log_reading import build_recording
from robots.robot import Robot
from robots.signals import Log


@pytest.fixture(scope="module")
def logs(arm: Robot, arm_log: Callable[..., Log]) -> list[Log]:
    """Returns three logs of different motions, a hundred seconds apart."""
    found: list[Log] = []
    for seed in range(3):
        log = arm_log(seed=seed, motion_seed=seed)
        found.append(replace(log, t=log.t - log.t[0] + 100.0 * seed, name=f"run{seed}"))
    return found


def _ringing(log: Log, joints: Sequence[int]) -> Log:
    """Returns the log with a torque on some joints that does not depend on its motion."""
    tau = np.array(log.tau)
    for j in joints:
        tau[:, j] = tau[:, j].std() * np.sign(np.sin(2 * np.pi * 1.7 * log.t + j))
    return replace(log, tau=tau)


def _found(arm: Robot, logs: Sequence[Log]) -> dict[int, float]:
    return find_unusable_logs(base_parameters(arm, "polynomial", (0.001,) * arm.n), build_recording(arm, logs))


@pytest.mark.slow
def test_only_a_log_that_no_parameters_explain_is_hopeless(arm: Robot, logs: list[Log]) -> None:
    """A log is unusable if no joint's torque is explained; one unexplained joint is not enough."""
    assert not _found(arm, logs)
    assert not _found(arm, [logs[0], _ringing(logs[1], [0]), logs[2]])
    found = _found(arm, [logs[0], _ringing(logs[1], [0, 1]), logs[2]])
    assert list(found) == [1]
    assert 0.8 < found[1] <= 1.0


@pytest.mark.slow
def test_where_all_are_hopeless_none_is_left_out(arm: Robot, logs: list[Log]) -> None:
    """A single log is never left out, and neither are logs that are all unusable."""
    assert not _found(arm, [_ringing(logs[0], [0, 1])])
    assert not _found(arm, [_ringing(log, [0, 1]) for log in logs])


@pytest.mark.slow
def test_a_diagnosis_says_what_it_left_out(arm: Robot, logs: list[Log]) -> None:
    """A diagnosis leaves out an unusable log, with a note, and gives the result of the others."""
    spoiled = diagnose(arm, [_ringing(logs[2], [0, 1]), logs[0], logs[1]], candidates=["stribeck"])
    alone = diagnose(arm, logs[:2], candidates=["stribeck"])
    assert any("Log 3 (run2) is left out" in note for note in spoiled.notes)
    assert spoiled.verdict == alone.verdict
    assert spoiled.baseline == pytest.approx(alone.baseline)
