"""Tests of changes with time in the torque signal, of products of velocities, and of worked grease."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimation import diagnose
from estimation.models.extension import find_effect
from robots import load_robot
from robots.regressor import default_model
from robots.robot import Robot
from robots.signals import Log
from robots.terms.discrepancies.clock_drift import ClockDrift
from robots.terms.discrepancies.families import FAMILIES
from robots.terms.discrepancies.gain_step import GainStep
from robots.terms.discrepancies.patterns import is_of_time
from robots.terms.effects import Situation, situation
from robots.terms.effects.time_delay import lateness


@pytest.mark.slow
def test_a_scale_that_changes_at_one_moment_is_not_called_heat(arm: Robot, arm_log: Callable[..., Log]) -> None:
    """A gain change of 4 % on one joint at 11 s is unexplained, with the joint, the size and the time."""
    log = arm_log(torque_noise=0.02)
    tau = log.tau.copy()
    tau[:, 1] *= np.where(log.t >= 11.0, 1.04, 1.0)
    heat_and_others = ("thermal_friction", "torque_constant_error", "torque_sensor_drift", "friction_step")
    found = diagnose(arm, replace(log, tau=tau), candidates=heat_and_others)
    assert found.verdict == "unexplained"
    (finding,) = found.findings
    assert finding.joint == 2
    assert "% more from t = 1" in finding.sentence
    assert float(finding.sentence.split("t = ")[1].split(" s")[0]) == pytest.approx(11.0, abs=0.3)
    assert float(finding.sentence.split("logged ")[1].split(" %")[0]) == pytest.approx(4.0, abs=0.8)


def test_clocks_that_part_are_a_delay_that_grows() -> None:
    """A delay that grows to 2 ms is fitted to a fifth of its change, with the same coefficients for all joints."""
    robot = load_robot("ur10")
    t = 0.004 * np.arange(3000)
    rates = np.array([0.9, 1.1, 1.3, 1.7, 2.1, 2.6])
    q, dq, ddq = (0.6 * rates**k * f(np.outer(t, rates)) for k, f in enumerate((np.sin, np.cos, lambda x: -np.sin(x))))
    model = default_model(replace(robot, friction=np.zeros((6, 4))))
    seen = situation(model, model.nominal, t, q, dq, ddq)
    late = 2e-3 * t / t[-1]
    target = np.column_stack([np.interp(t - late, t, column) - column for column in seen.torque.T])
    X = ClockDrift().columns(seen, None)
    steady = lateness(seen, 1e-3)[:, :, None]
    values = np.linalg.lstsq(np.concatenate([X, steady], axis=2).reshape(-1, 4), target.ravel(), rcond=None)[0]
    sentence = ClockDrift().describe(None, values[:-1])
    assert float(sentence.split("about ")[1].split(" ms")[0]) == pytest.approx(2.0, rel=0.2)


def test_both_are_found_by_their_names_and_know_only_time(arm: Robot) -> None:
    """Both effects are found by name and count as changes with time; a gain step resembles one specific cause."""
    assert isinstance(find_effect(GainStep.name), GainStep)
    assert isinstance(find_effect(ClockDrift.name), ClockDrift)
    assert is_of_time(GainStep())
    assert is_of_time(ClockDrift())
    assert ClockDrift().joints(arm) == ()
    assert ClockDrift().joints(load_robot("ur10")) == (None,)


def test_a_rotor_that_spins_in_a_turning_arm_feels_products_of_velocities(swept: Situation) -> None:
    """The family has the products of another joint's velocity with those of further joints, and no other products."""
    X = FAMILIES["whirl"].columns(swept, 4, 2, ())
    further = [0, 2, 4, 5]
    np.testing.assert_allclose(X[:, : len(further)], swept.dq[:, 1, None] * swept.dq[:, further])
    assert not X[:, len(further) :].any()
    assert not FAMILIES["whirl"].columns(swept, 4, 4, ()).any()


def test_grease_that_thins_as_it_is_worked_is_within_its_columns(swept: Situation) -> None:
    """Friction that falls with the speed of the last second is fitted to a tenth of its size."""
    speed = np.abs(swept.dq[:, 3])
    follows = np.zeros_like(speed)
    for k in range(1, len(speed)):
        follows[k] = follows[k - 1] + swept.period / 1.0 * (speed[k] - follows[k - 1])
    target = -(1.0 + 0.5 * speed) * follows
    target[:150] = 0.0
    X = FAMILIES["worked"].columns(swept, 4, 4, (float(speed.max()),))
    X = np.column_stack([X, np.ones(len(speed)), speed])[150:]
    left = target[150:] - X @ np.linalg.lstsq(X, target[150:], rcond=None)[0]
    assert np.sqrt(np.mean(left**2)) < 0.1 * np.std(target[150:])
