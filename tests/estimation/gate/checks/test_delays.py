"""Delays of the torque of a joint that sticks at its reversals: a plant with Karnopp's stiction in a position loop."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.gate import Context, check_log
from estimation.gate.checks.delays import findings_of
from estimation.gate.quick_fits.delays import Delay, sticking_time
from robots.geometry.chain import Chain, Joint
from robots.limits import Limits
from robots.robot import Robot
from robots.signals import Log
from tests.estimation.gate.findings_of import found

INERTIA, WEIGHT, COULOMB, STATIC, VISCOUS = 1.2, 15.0, 30.0, 36.0, 4.0
STEP, EVERY, SECONDS = 0.001, 4, 40.0


@pytest.fixture(scope="module")
def pendulum() -> Robot:
    """A link on a horizontal axis."""
    one = np.ones(1)
    return Robot(
        name="pendulum",
        chain=Chain((Joint("swing", "revolute", np.eye(3), np.zeros(3)),), gravity=np.array([0.0, -9.81, 0.0])),
        limits=Limits(
            lower=-3 * one, upper=3 * one, velocity=4 * one, acceleration=40 * one, jerk=900 * one, torque=90 * one
        ),
        inertia=np.array([[4.0, WEIGHT / 9.81, 0, 0, 0.01, 0, 0, 1.0, 0, 1.0]]),
        rotor_inertia=0.2 * one,
        friction=np.array([[10.0, 3.0, 0, 0]]),
    )


@pytest.fixture(scope="module")
def sticking() -> Log:
    """The joint follows three tones; at each reversal it stands until the loop has wound up the static friction."""
    rng = np.random.default_rng(3)
    count = round(SECONDS / STEP)
    t = STEP * np.arange(count)
    w, phase = 2 * np.pi * np.array([0.1, 0.23, 0.41]), np.array([0.3, 1.9, 4.0])
    target = (0.35 * np.sin(t[:, None] * w + phase)).sum(axis=1)
    speed = np.gradient(target, STEP)
    q, v, wound = target[0], 0.0, 0.0
    position, torque = np.empty(count), np.empty(count)
    for k in range(count):
        wound += 200000.0 * (target[k] - q) * STEP
        drive = 20000.0 * (target[k] - q) + 500.0 * (speed[k] - v) + wound + WEIGHT * np.cos(q)
        position[k], torque[k] = q, drive
        free = drive - WEIGHT * np.cos(q)
        if v == 0.0 and abs(free) <= STATIC:
            continue
        sign = np.sign(v) if v != 0.0 else np.sign(free)
        after = v + STEP * (free - sign * COULOMB - VISCOUS * v) / INERTIA
        v = 0.0 if after * sign < 0.0 else after
        q += STEP * v
    noise = 0.02 * torque.std() * rng.normal(size=count)
    counts = 2 * np.pi / 2**20
    rows = slice(None, None, EVERY)
    return Log(t[rows], (counts * np.round(position / counts))[rows, None], tau=(torque + noise)[rows, None])


@pytest.mark.slow
def test_a_longer_delay_is_found_beside_stiction(pendulum, sticking):
    """The log on one clock has no delay; a torque that is logged 80 ms late is found, beyond the stiction."""
    assert not found(check_log(pendulum, sticking), "delay")
    rows = 20
    late = replace(sticking, tau=np.vstack([np.repeat(sticking.tau[:1], rows, axis=0), sticking.tau[:-rows]]))
    (finding,) = found(check_log(pendulum, late), "delay")
    assert finding.value == pytest.approx(0.08, abs=0.012)


@pytest.mark.slow
def test_the_time_of_standing_is_measured(pendulum, sticking):
    """Against the runs of equal encoder counts at reversals. Smoothing shortens them, by half at most."""
    rows = Context(pendulum, sticking).smoothed.choice.sharp
    q, period = sticking.q[:, 0], 0.004
    still = np.concatenate([[False], np.abs(np.diff(q)) < 2e-6, [False]])
    starts, ends = np.flatnonzero(np.diff(still.astype(int)) == 1), np.flatnonzero(np.diff(still.astype(int)) == -1)
    runs = [(a, b) for a, b in zip(starts, ends, strict=True) if b - a > 2 and a > 9 and b < len(q) - 9]
    standing = [(b - a) * period for a, b in runs if (q[a] - q[a - 9]) * (q[b + 9] - q[b]) < 0]
    assert len(standing) > 10
    assert 0.5 * np.median(standing) <= sticking_time(rows, 0) <= np.median(standing) + period


@pytest.mark.parametrize(("sticks", "count"), [(0.0, 1), (0.025, 0)])
def test_joints_that_stand_have_no_common_delay(sticks, count):
    """Six joints lead by 8.5 ms. It is a finding unless all of them stand at their reversals for longer."""
    delays = [Delay(-0.0085, 2e-4, 0.25, sticks)] * 6
    assert len(findings_of(delays, 0.004)) == count
