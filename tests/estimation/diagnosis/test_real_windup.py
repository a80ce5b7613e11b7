"""Test of gear compliance on a real heavy arm with encoders on both sides of its gears."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from estimation.diagnosis.base_models.baseline import base_model_prior, base_parameters, build_baseline
from estimation.diagnosis.recordings.log_reading import build_recording
from estimation.diagnosis.validations.gear_compliance import measure_gear_compliance
from tests.kr300 import kr300


@pytest.mark.slow
def test_a_heavy_arm_s_gears(data: Callable[[str], Path], tmp_path: Path) -> None:
    """The stiffness intervals of joints 2 and 3 contain the maker's values; joint 1 has too little load.

    All three link encoders have the same delay of 3 ms. Its contribution, proportional to velocity, hides nine tenths
    of the deflection until it is subtracted.
    """
    robot, log = kr300(data("kuka_kr300_weigand"), tmp_path / "kr300.yaml")
    recording = build_recording(robot, [log])
    base = build_baseline(base_parameters(robot, "polynomial", (0.001,) * 6), recording)
    weights = ~recording.sign_unknown / recording.tau.std(axis=0)
    values = base.fitted(weights, recording.tau, base_model_prior(base, recording))
    found = measure_gear_compliance(base.situation(recording, values), recording, [log], false_alarm=0.01)
    assert [windup.finding.joint for windup in found] == [2, 3]
    for windup, nominal in zip(found, (7.52e6, 4.10e6), strict=True):
        compliance, _, delay = windup.finding.parameters
        assert compliance.ci95[0] < 1 / nominal < compliance.ci95[1]
        assert delay.value == pytest.approx(3.0e-3, abs=1e-4)
        assert windup.finding.gain.ci95[0] > 0
