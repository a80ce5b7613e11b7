"""Heat: the thermal model between windows, and what all joints share."""

import dataclasses

import numpy as np
import pytest

from estimation.monitoring.observations import common_change
from estimation.monitoring.windows.heat import HeatState
from estimation.thermal import ThermalTorqueModel
from robots.common.errors import InputError
from robots.thermal import FirstOrder


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


@pytest.fixture
def geared(baseline):
    """Six joints whose gears have time constants from 5 to 30 min, and friction that falls by a third at 50 W."""
    models = tuple(
        FirstOrder(alpha=-0.02, beta=1.0, ambient=20.0, K=2.0, C=2.0 * 60.0 * minutes)
        for minutes in (5.0, 10.0, 15.0, 20.0, 25.0, 30.0)
    )
    return dataclasses.replace(baseline, thermal=ThermalTorqueModel(model=baseline.model, thermal=models))


def worked(state, share, minutes):
    """A minute of logged motion, then a pause with work in a share of it, by Euler's rule."""
    T = np.array([model.ambient for model in state.models])
    for second in range(60 + round(60 * minutes)):
        power = 50.0 * (1.0 if second < 60 else share)
        joints = zip(T, state.models, strict=True)
        T += [(power * (1 - 0.02 * (x - 20.0)) - m.K * (x - m.ambient)) / m.C for x, m in joints]
        if second < 60 and second % 10 == 0:
            factors = 1 - 0.02 * (T - 20.0)
            state.advance(50.0 * factors, 10.0, None)
    state.pause(60.0 * minutes, None)
    return 1 - 0.02 * (T - 20.0)


@pytest.mark.parametrize(("share", "duty"), [(0.0, 0.0), (0.5, 0.65), (1.0, 1.0)])
def test_duty_of_a_pause_is_found_from_all_joints(geared, share, duty):
    """The joints agree on the heat of a pause, although their gears have other time constants.

    Work in half of the time gives about 0.65 of the heat, because colder joints have more friction. The duty is within
    0.1 of that. With it the friction of each joint is explained within 2 %, of changes by up to 25 %.
    """
    state = HeatState("model", geared)
    factors = worked(state, share, 25.0)
    rest = np.log(factors) - np.log([state.factor(j) for j in range(6)])
    found = np.zeros(2)
    for _ in range(5):
        sensitivity = np.array([state.sensitivity(j) for j in range(6)])
        found, _ = common_change(rest, np.full(6, 0.005**2), sensitivity, state.common_spread, None)
        state.work.duties = [float(found[1])]
    assert found[1] == pytest.approx(duty, abs=0.1)
    np.testing.assert_allclose(rest, sensitivity @ found, atol=0.02)
    if duty == 1.0:
        assert rest.min() < -0.2


def test_short_gap_is_no_pause(geared):
    """Twenty seconds without rows are a rest: no duty is looked for."""
    state = HeatState("model", geared)
    state.advance(np.full(6, 50.0), 60.0, None)
    state.pause(20.0, None)
    assert all(state.sensitivity(j)[1] == 0.0 for j in range(6))


def test_heat_with_pauses_is_restored(geared):
    """A saved state goes on as the one that was saved."""
    state = HeatState("model", geared)
    worked(state, 1.0, 25.0)
    state.work.duties = [0.8, 0.9]
    other = HeatState.from_dict(state.to_dict(), kind="model", baseline=geared)
    for each in (state, other):
        each.advance(np.full(6, 50.0), 10.0, None)
        each.pause(600.0, None)
    assert other.to_dict() == state.to_dict()
