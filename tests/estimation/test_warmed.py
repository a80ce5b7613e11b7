"""Specification of predictions by a model whose effects keep heat: what came before a motion acts in it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimation import predict
from estimation.logs.clocks import UNKNOWN_PAUSE
from estimation.models.extension import Extension
from estimation.models.model import Model
from estimation.predictions.earlier_logs import COLD, warmed
from robots.common.errors import InputError
from robots.regressor import default_model
from robots.signals import Log

FALL, CONSTANT, JOINT = 2.0, 200.0, 1


@pytest.fixture(scope="module")
def warming(arm) -> Model:
    """The described arm, whose first joint loses 2 N m of Coulomb friction per kilojoule, kept for 200 s."""
    model = default_model(arm, velocity_scale=1e-3)
    values = model.nominal
    heat = Extension(
        effect="thermal_friction",
        joint=JOINT,
        shape=(CONSTANT, 0.0, 0.0),
        coefficients=np.array([FALL, 0.0]),
        covariance=np.zeros((5, 5)),
    )
    return Model(
        torque_model=model,
        columns=tuple(range(model.size)),
        values=values,
        covariance=np.zeros((model.size, model.size)),
        determined=np.full(model.size, True),
        formulas=model.names,
        extensions=(heat,),
    )


@pytest.fixture(scope="module")
def motion(arm, arm_log) -> Log:
    return replace(arm_log(), tau=None)


def _kept(model: Model, log: Log, later: float) -> float:
    """Heat [kJ] that a log leaves so much later [s], by the integral of the friction's power over its time."""
    own = predict(replace(model, extensions=()), log).motion
    parameters = dict(zip(model.names, model.values, strict=True))
    coulomb, viscous = (parameters[f"{name}_{JOINT}"] for name in ("f1", "f2"))
    speed = own.dq[:, JOINT - 1]
    power = coulomb * np.abs(speed) + viscous * speed**2
    weight = np.exp(-(own.t[-1] + later - own.t) / CONSTANT)
    return float(np.trapezoid(power * weight, own.t)) / 1000.0


@pytest.mark.parametrize("gap", [5.0, 120.0])
def test_friction_is_less_by_the_heat_that_is_left(warming: Model, motion: Log, gap: float) -> None:
    """The heat before fades by the time between, and takes its share off friction at the motion's first moment."""
    next_one = replace(motion, t=motion.t + motion.t[-1] - motion.t[0] + gap)
    cold, warm = predict(warming, next_one), predict(warming, next_one, before=[motion])
    difference = (warm.predicted - cold.predicted)[:, JOINT - 1]
    fast = np.abs(cold.motion.dq[:, JOINT - 1]) > 0.1
    at = int(np.argmax(fast))
    since = gap + float(cold.motion.t[at] - cold.motion.t[0])
    expected = -FALL * _kept(warming, motion, since) * np.sign(cold.motion.dq[at, JOINT - 1])
    assert abs(expected) > 0.005
    assert difference[at] == pytest.approx(expected, rel=0.02)
    # Other joints keep no heat.
    np.testing.assert_array_equal(warm.predicted[:, JOINT:], cold.predicted[:, JOINT:])


def test_clocks_that_began_anew_count_a_pause_apart(warming: Model, motion: Log) -> None:
    """Two files that both begin at zero: the first counts as recorded a minute before the second, which is said."""
    apart = replace(motion, t=motion.t - motion.t[-1] - UNKNOWN_PAUSE + motion.t[0])
    np.testing.assert_allclose(
        predict(warming, motion, before=[motion]).predicted, predict(warming, motion, before=[apart]).predicted
    )
    assert "60 s apart" in warmed(warming, [motion], motion, 0.0)[1]
    assert "60 s apart" not in warmed(warming, [apart], motion, 0.0)[1]
    assert warmed(warming, [], motion, 0.0)[1] == COLD


def test_what_comes_after_or_warms_nothing_is_refused(warming: Model, motion: Log) -> None:
    """A log that begins when the motion has ended, and any beside a model that keeps no heat."""
    after = replace(motion, t=motion.t + 1000.0)
    with pytest.raises(InputError, match="starts after the predicted motion"):
        predict(warming, motion, before=[after])
    plain = replace(warming, extensions=())
    assert warmed(plain, [], motion, 0.0) == ([], "")
    with pytest.raises(InputError, match="no thermal part"):
        predict(plain, motion, before=[motion])
