"""Tests of intermittent torques: periodic forces on the flange, against pinocchio, and temporary friction."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from estimation import diagnose
from estimation.models.extension import find_effect
from robots import load_robot
from robots.regressor import default_model
from robots.robot import Robot
from robots.signals import Log
from robots.terms.discrepancies.intermittent_torque import IntermittentTorque, PeriodicTorque
from robots.terms.discrepancies.patterns import is_of_time
from robots.terms.effects import Situation, situation
from tests.estimation.diagnosis.pinocchio_chains import chain_of

FORCE = np.array([3.0, -5.0, 8.0])  # [N]
PERIOD, MOMENT, LASTS = 4.3, 71.0, 0.2  # [s]
RATES = np.array([0.9, 1.1, 1.3, 1.7, 2.1, 2.6])  # [rad/s]


def _moved(rates: np.ndarray, pause: float = 0.0) -> Situation:
    """Builds a minute of a motion of six joints, optionally with a pause in the middle."""
    robot, t = load_robot("ur10"), 0.02 * np.arange(3000)
    q, dq, ddq = (0.6 * rates**k * f(np.outer(t, rates)) for k, f in enumerate((np.sin, np.cos, lambda x: -np.sin(x))))
    model, late = default_model(robot), np.where(t >= 30.0, pause, 0.0)
    starts = (0, 1500) if pause else (0,)
    return situation(model, model.nominal, 40.0 + t + late, q, dq, ddq, starts=starts)


@pytest.fixture(scope="module")
def moved() -> Situation:
    """Returns a motion that does not repeat."""
    return _moved(RATES)


@pytest.fixture(scope="module")
def pushed(moved: Situation) -> np.ndarray:
    """Computes pinocchio's torque (N, 6) for a periodic force on the flange."""
    model, last = chain_of(moved.robot)
    tip = np.asarray(moved.robot.chain.tip)
    frame = model.addFrame(pin.Frame("flange", last, pin.SE3(tip[:3, :3], tip[:3, 3]), pin.FrameType.OP_FRAME))
    data, aligned = model.createData(), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    jacobians = [pin.computeFrameJacobian(model, data, row, frame, aligned)[:3] for row in moved.q]
    x = np.minimum((moved.t - MOMENT) % PERIOD / LASTS, 1.0)
    return np.array([J.T @ FORCE for J in jacobians]) * np.maximum(np.sin(np.pi * x), 0.0)[:, None] ** 0.6


def test_a_force_that_comes_again_is_within_its_columns(moved: Situation, pushed: np.ndarray) -> None:
    """The columns give pinocchio's torque, and the coefficients are the force."""
    X = PeriodicTorque().columns(moved, None, (PERIOD, MOMENT, LASTS))
    values = np.linalg.lstsq(X.reshape(-1, 3), pushed.ravel(), rcond=None)[0]
    np.testing.assert_allclose(values, FORCE, rtol=1e-6)
    np.testing.assert_allclose(X @ values, pushed, atol=1e-6 * np.abs(pushed).max())
    assert "of 9.9 N on the flange that comes every 4.3 s for 0.2 s" in PeriodicTorque().describe(
        None, FORCE, (PERIOD, MOMENT, LASTS)
    )


def test_its_period_is_proposed_out_of_noise(moved: Situation, pushed: np.ndarray) -> None:
    """With pulses of a third of the noise, one of six proposals has the right period, time and duration."""
    noise = np.random.default_rng(0).standard_normal(pushed.shape) * np.sqrt(np.mean(pushed**2, axis=0)) * 3.0
    proposed = PeriodicTorque().propose(moved, None, (pushed + noise) / np.var(noise, axis=0), 6)
    assert len(proposed) == 6
    last = (moved.t[-1] - moved.t[0]) / 2 / PERIOD  # pushes between the middle of the data and their end
    middle = MOMENT + LASTS / 2
    assert any(
        abs(period - PERIOD) * last < LASTS
        and abs((moment + duration / 2 - middle + period / 2) % period - period / 2) < LASTS
        and 0.3 < duration / LASTS < 3.0
        for period, moment, duration in proposed
    )


@pytest.mark.slow
def test_a_period_with_which_the_motion_repeats_is_none() -> None:
    """Periods of the motion are not tried, and none at all if logs are hours apart."""
    periodic = _moved(2 * np.pi / 6.0 * np.array([1.0, 2.0, 3.0, 1.0, 2.0, 3.0]))
    periods = {shape[0] for shape in PeriodicTorque().grid(periodic, None)}
    assert periods
    assert not [period for period in periods if abs(1 / period - 1 / 6.0) < 0.3 / 60.0]
    assert [period for period in periods if 4.0 < period < 5.0]
    assert PeriodicTorque().grid(_moved(RATES, pause=3600.0), None) == ()


@pytest.mark.slow
def test_friction_of_a_while_is_unexplained_with_its_time(arm: Robot, arm_log: Callable[..., Log]) -> None:
    """A brake that drags on joint 2 from 8 s for 4 s is unexplained, with joint, size, start and duration."""
    log = arm_log(torque_noise=0.02)
    size = 0.05 * float(np.sqrt(np.mean(log.tau[:, 1] ** 2)))
    during = (log.t > 8.0) & (log.t < 12.0)
    tau = log.tau.copy()
    tau[:, 1] += size * during * np.sign(np.gradient(log.q[:, 1]))
    found = diagnose(arm, replace(log, tau=tau), candidates=("friction_step", "thermal_friction", "external_contact"))
    assert found.verdict == "unexplained"
    finding = found.findings[0]
    assert finding.joint == 2
    assert finding.pattern == IntermittentTorque.name
    friction, start, duration = (parameter.value for parameter in finding.parameters)
    assert friction == pytest.approx(size, rel=0.25)
    assert start == pytest.approx(8.0, abs=0.3)
    assert duration == pytest.approx(4.0, abs=0.5)


def test_a_spell_is_no_change_for_good(moved: Situation) -> None:
    """Both effects are found by name and are changes with time; temporary friction lasts at most 40 % of the data."""
    assert isinstance(find_effect(IntermittentTorque.name), IntermittentTorque)
    assert isinstance(find_effect(PeriodicTorque.name), PeriodicTorque)
    assert is_of_time(IntermittentTorque())
    assert is_of_time(PeriodicTorque())
    assert PeriodicTorque().joints(moved.robot) == (None,)
    assert (
        max(duration for _, duration in IntermittentTorque().grid(moved, 1))
        <= IntermittentTorque().bounds(moved, 1)[1][1]
        <= 24.1
    )
    target = 2.0 * moved.sign[:, 1] * ((moved.t > 60.0) & (moved.t < 66.0))
    noise = np.random.default_rng(1).standard_normal((len(moved), 6)) * 3.0
    noise[:, 1] += target
    best = IntermittentTorque().propose(moved, 2, noise, 4)
    assert any(abs(start - 60.0) <= 1.5 and duration == 6.0 for start, duration in best)
