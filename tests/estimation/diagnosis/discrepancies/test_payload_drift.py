"""Tests of a slowly changing payload, against pinocchio's torque of a point mass."""

from __future__ import annotations

import numpy as np
import pytest

from estimation.models.extension import find_effect
from robots import load_robot
from robots.robot import Robot
from robots.terms.discrepancies.patterns import is_of_time
from robots.terms.discrepancies.payload_drift import PayloadDrift
from robots.terms.effects import Situation
from tests.estimation.diagnosis.pinocchio_chains import torque_of_mass

COM = np.array([0.03, -0.02, 0.1])  # [m] in the flange's frame


def test_a_tank_that_empties_is_within_its_columns(swept: Situation) -> None:
    """The torque is fitted to 8 % of its largest value, and the lost mass is described to a tenth."""
    t = swept.t - swept.t[0]
    kilogramme = torque_of_mass(swept.robot, 1.0, COM, swept.q, swept.dq, swept.ddq)
    lost = 2.0 * np.exp(-t / 6.0)
    extra = kilogramme * lost[:, None]
    # The base model contains a constant payload.
    stays = swept.sensitivity("tool")[:, :, :4]
    X = np.concatenate([PayloadDrift().columns(swept, None), stays], axis=2)
    rows = X.reshape(-1, X.shape[2])
    values = np.linalg.lstsq(rows, extra.ravel(), rcond=None)[0]
    np.testing.assert_allclose(rows @ values, extra.ravel(), atol=0.08 * np.abs(extra).max())
    sentence = PayloadDrift().describe(None, values[:-4])
    assert float(sentence.split("empties: by ")[1].split(" kg")[0]) == pytest.approx(np.ptp(lost), rel=0.1)


def test_it_is_of_a_whole_robot_and_goes_by_time(arm: Robot) -> None:
    """The effect is found by its name, is a change with time, and needs at least three joints."""
    found = find_effect(PayloadDrift.name)
    assert isinstance(found, PayloadDrift)
    assert is_of_time(found)
    assert found.joints(load_robot("ur10")) == (None,)
    assert found.joints(arm) == ()
