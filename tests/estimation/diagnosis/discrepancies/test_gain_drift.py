"""Tests of a common gain drift of all joints' torque signals."""

from __future__ import annotations

import numpy as np
import pytest

from estimation.models.extension import find_effect
from robots import load_robot
from robots.robot import Robot
from robots.terms.discrepancies.gain_drift import FEWEST_JOINTS_OF_DRIFT, GainDrift
from robots.terms.discrepancies.patterns import is_of_time
from robots.terms.effects import Situation


def test_a_slow_gain_of_all_joints_is_within_its_columns(swept: Situation) -> None:
    """A gain that rises and falls is fitted to a tenth of its change, with the same coefficients for all joints."""
    x = (swept.t - swept.t[0]) / np.ptp(swept.t)
    gain = 0.05 * np.exp(-(((x - 0.4) / 0.3) ** 2))
    extra = swept.torque * gain[:, None]
    X = np.concatenate([GainDrift().columns(swept, None), swept.torque[:, :, None]], axis=2)
    rows, target = X.reshape(-1, X.shape[2]), extra.ravel()
    values = np.linalg.lstsq(rows, target, rcond=None)[0]
    size = np.ptp(gain) * np.abs(swept.torque).max()
    np.testing.assert_allclose(rows @ values, target, atol=0.1 * size)
    sentence = GainDrift().describe(None, values[:-1])
    assert float(sentence.split("over the logs is ")[1].split(" %")[0]) == pytest.approx(100 * np.ptp(gain), rel=0.1)


def test_one_or_two_joints_share_nothing(arm: Robot) -> None:
    """The effect needs at least three joints, because with fewer a common change is not distinct."""
    assert arm.n < FEWEST_JOINTS_OF_DRIFT
    assert GainDrift().joints(arm) == ()
    assert GainDrift().joints(load_robot("ur10")) == (None,)


def test_it_is_found_by_its_name_and_knows_only_time() -> None:
    """The effect is found by its name and counts as a change with time."""
    found = find_effect(GainDrift.name)
    assert isinstance(found, GainDrift)
    assert is_of_time(found)
