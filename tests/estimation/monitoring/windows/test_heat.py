"""Heat: the thermal model between windows, and what all joints share."""

import dataclasses

import numpy as np
import pytest

from estimation.monitoring.windows.heat import HeatState, common_change
from estimation.thermal import ThermalTorqueModel
from robots.common.errors import InputError
from robots.thermal import FirstOrder


def test_common_change_ignores_the_joint_that_deviates():
    """Five joints share -0.3, one has +0.2 beside it: the common change is that of the five."""
    d = np.array([-0.3, -0.31, -0.29, -0.1, -0.3, -0.3])
    found, variance = common_change(d, np.full(6, 0.01**2), np.ones(6), 0.5, None)
    assert found == pytest.approx(-0.3, abs=0.01)
    left, _ = common_change(d, np.full(6, 0.01**2), np.ones(6), 0.5, 3)
    assert left == pytest.approx(-0.3, abs=0.003)
    assert variance < 0.01**2


def test_common_change_without_prior_knowledge_is_zero():
    """Without a common unknown, nothing is taken out."""
    assert common_change(np.ones(3), np.ones(3), np.ones(3), 0.0, None) == (0.0, 0.0)


def test_heat_follows_the_closed_form(baseline):
    """Constant power for 1000 s in steps of 10 s gives T = Te + P / K (1 - exp(-t K / C)) (thesis eq. 110)."""
    first = FirstOrder(alpha=-0.01, beta=1.0, ambient=20.0, K=2.0, C=600.0)
    thermal = ThermalTorqueModel(model=baseline.model, thermal=(first,) + (None,) * 5)
    state = HeatState("model", dataclasses.replace(baseline, thermal=thermal))
    for _ in range(100):
        state.advance(np.array([50.0, 0, 0, 0, 0, 0]), 10.0, None)
    rise = 25.0 * (1 - np.exp(-1000.0 * 2.0 / 600.0))
    assert state.factor(0) == pytest.approx(1 - 0.01 * rise, rel=1e-9)
    assert state.factor(1) == 1.0
    assert state.features(0) == pytest.approx([np.log(1 - 0.01 * rise), 1.0])


def test_heat_of_a_thermal_model_needs_one(baseline):
    """--heat model without a thermal model is refused."""
    with pytest.raises(InputError, match="no thermal part"):
        HeatState("model", baseline)
