import dataclasses
import sys

import numpy as np
import pinocchio
import pytest
from numpy.polynomial import Polynomial

from oed.retiming import Toppra, retime
from robots.common.errors import InfeasibleError, InputError
from robots.limits import Limits
from robots.signals import Motion

PERIOD = 0.004
INF = np.inf


def _limits(velocity, acceleration, jerk=INF, torque=INF, n=2) -> Limits:
    one = np.ones(n)
    return Limits(
        lower=-10 * one,
        upper=10 * one,
        velocity=velocity * one,
        acceleration=acceleration * one,
        jerk=jerk * one,
        torque=torque * one,
    )


def _wave(duration=10.0, n=6, seed=0) -> Motion:
    """A smooth motion at rest at both ends: a bell times sines, differentiated by polynomial arithmetic."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(duration / PERIOD) + 1) * PERIOD
    x = Polynomial([0.0, 1.0 / duration])
    columns = []
    for _ in range(n):
        shape = (x * (1 - x)) ** 3 * 30 * Polynomial(rng.normal(size=5))(2 * x - 1)
        columns.append([shape(t), shape.deriv()(t), shape.deriv(2)(t)])
    q, dq, ddq = np.array(columns).transpose(1, 2, 0)
    return Motion(t, q, dq, ddq)


def _check(result, limits: Limits, torque=None) -> None:
    motion = result.motion
    assert motion.period == pytest.approx(PERIOD)
    np.testing.assert_allclose(motion.dq[[0, -1]], 0.0, atol=1e-9)
    np.testing.assert_allclose(motion.ddq[[0, -1]], 0.0, atol=1e-6)
    assert np.all(np.abs(motion.dq) <= limits.velocity)
    assert np.all(np.abs(motion.ddq) <= limits.acceleration)
    if np.isfinite(limits.jerk).any():
        assert np.all(np.abs(np.diff(motion.ddq, axis=0)) / PERIOD <= limits.jerk * (1 + 1e-12))
    if torque is not None:
        assert np.all(np.abs(torque(motion)) <= limits.torque)


def test_a_line_takes_the_time_of_a_trapezoid():
    """Without jerk limits a straight path takes d/v + v/a, the optimum, plus the short window at the ends."""
    limits = _limits(2.0, 10.0)
    result = retime(np.array([[0.0, 0.0], [1.5, 3.0]]), limits, period=PERIOD, options=Toppra(limit_jerk=False))
    _check(result, limits)
    optimum = 3.0 / 2.0 + 2.0 / 10.0
    assert optimum <= result.duration_after <= optimum + 5 * PERIOD
    np.testing.assert_allclose(result.motion.q[:, 1], 2 * result.motion.q[:, 0], atol=1e-12)
    np.testing.assert_allclose(result.motion.q[[0, -1]], [[0.0, 0.0], [1.5, 3.0]], atol=1e-12)
    assert np.isnan(result.duration_before)


def test_a_line_under_a_jerk_limit_is_near_its_optimum():
    """With a jerk limit a straight path takes d/v + v/a + a/j within one percent."""
    limits = _limits(2.0, 10.0, 100.0)
    result = retime(np.array([[0.0, 0.0], [1.5, 3.0]]), limits, period=PERIOD)
    _check(result, limits)
    optimum = 3.0 / 2.0 + 2.0 / 10.0 + 10.0 / 100.0
    assert optimum - 1e-9 <= result.duration_after <= 1.01 * optimum


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("jerk", [True, False])
def test_a_curve_gets_faster_and_keeps_path_and_limits(limits, seed, jerk):
    """A slow motion becomes faster, its samples keep every limit, come close to one, and lie on the old path."""
    slow = _wave(duration=20.0, seed=seed)
    result = retime(slow, limits, period=PERIOD, options=Toppra(limit_jerk=jerk))
    _check(result, limits if jerk else dataclasses.replace(limits, jerk=np.full(6, INF)))
    assert result.duration_after < 0.6 * slow.duration
    assert result.duration_before == pytest.approx(20.0)
    assert max(value.max() for name, value in result.usage.items() if jerk or name != "jerk") > 0.97
    # Every new sample lies within the spacing of the old ones of the old path.
    step = np.abs(np.diff(slow.q, axis=0)).max()
    distance = np.array([np.abs(slow.q - q).max(axis=1).min() for q in result.motion.q[::10]])
    assert distance.max() <= step + result.deviation
    assert result.deviation < 1e-3
    np.testing.assert_allclose(result.motion.q[[0, -1]], slow.q[[0, -1]], atol=1e-9)


@pytest.mark.slow
def test_velocity_and_acceleration_are_the_derivatives_of_position(limits):
    """The three columns of the result belong together: each is the integral of the next by Simpson's rule."""
    motion = retime(_wave(seed=5), limits, period=PERIOD).motion
    for value, rate, scale in ((motion.q, motion.dq, limits.acceleration), (motion.dq, motion.ddq, limits.jerk)):
        error = value[2:] - value[:-2] - PERIOD / 3 * (rate[2:] + 4 * rate[1:-1] + rate[:-2])
        # Where the rate has a corner within the step, Simpson errs by a fraction of h^2 times its slope.
        assert np.all(np.abs(error).max(axis=0) <= PERIOD**2 * 2 * scale)


def test_there_and_back_stops_at_the_turn():
    """A path that turns back is split there, comes to rest, and is covered fully."""
    q = np.concatenate([np.linspace(0.0, 1.0, 200), np.linspace(1.0, 0.0, 200)])
    limits = _limits(2.0, 10.0, 200.0, n=1)
    result = retime(q[:, None], limits, period=PERIOD)
    assert result.stops == 1
    _check(result, limits)
    turn = int(result.motion.q[:, 0].argmax())
    assert result.motion.q[turn, 0] == pytest.approx(1.0, abs=1e-9)
    assert result.motion.dq[turn, 0] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.slow
def test_a_pause_is_dropped():
    """A motion that rests on the way is split there, and the rest takes no time."""
    half = _wave(duration=4.0, n=2, seed=1)
    pause = 250
    still = np.zeros((pause, 2))
    t = np.arange(2 * len(half) + pause) * PERIOD
    whole = Motion(
        t,
        np.concatenate([half.q, still + half.q[-1], half.q]),
        np.concatenate([half.dq, still, half.dq]),
        np.concatenate([half.ddq, still, half.ddq]),
    )
    limits = _limits(2.0, 10.0, 200.0)
    once, twice = retime(half, limits, period=PERIOD), retime(whole, limits, period=PERIOD)
    assert twice.stops == once.stops + 1
    assert twice.duration_after == pytest.approx(2 * once.duration_after, abs=2 * PERIOD)


class _Arm:
    """A planar arm of two links in the vertical plane, built and evaluated by pinocchio."""

    def __init__(self) -> None:
        self.model = pinocchio.Model()
        joint = 0
        for length, mass in ((0.0, 4.0), (0.5, 2.0)):
            place = pinocchio.SE3(np.eye(3), np.array([length, 0.0, 0.0]))
            joint = self.model.addJoint(joint, pinocchio.JointModelRY(), place, f"j{length}")
            inertia = pinocchio.Inertia(mass, np.array([0.25, 0.0, 0.0]), 0.02 * np.eye(3))
            self.model.appendBodyToJoint(joint, inertia, pinocchio.SE3.Identity())
        self.data = self.model.createData()
        self.coulomb, self.viscous = np.array([3.0, 1.0]), np.array([2.0, 0.7])

    def rigid(self, q, dq, ddq):
        return np.array([pinocchio.rnea(self.model, self.data, *row) for row in zip(q, dq, ddq, strict=True)])

    def friction(self, dq):
        return self.coulomb * np.sign(dq) + self.viscous * dq

    def torque(self, motion):
        return self.rigid(motion.q, motion.dq, motion.ddq) + self.friction(motion.dq)


@pytest.mark.slow
def test_torque_with_friction_keeps_its_limit_and_nearly_uses_it():
    """Rigid-body torque plus Coulomb and viscous friction, evaluated afresh at every sample, stays within the limit."""
    arm = _Arm()
    limits = _limits(20.0, 500.0, torque=np.array([35.0, 11.0]))
    t = np.linspace(0.0, 1.0, 300)[:, None]
    path = np.hstack([1.5 * np.sin(2.0 * t), -2.0 * t + 0.5 * np.sin(6.0 * t)])
    result = retime(
        path, limits, period=PERIOD, inverse_dynamics=arm.rigid, friction=arm.friction, options=Toppra(limit_jerk=False)
    )
    _check(result, limits, arm.torque)
    np.testing.assert_allclose(
        result.usage["torque"], np.abs(arm.torque(result.motion)).max(axis=0) / limits.torque, rtol=1e-12
    )
    assert result.usage["torque"].max() > 0.9
    # Without friction to overcome the same path is faster.
    free = retime(path, limits, period=PERIOD, inverse_dynamics=arm.rigid, options=Toppra(limit_jerk=False))
    assert free.duration_after < result.duration_after


def test_dry_friction_helps_to_brake():
    """A unit inertia with dry friction c speeds up at limit - c and brakes at limit + c: the closed-form optimum."""
    limits = _limits(100.0, 1000.0, torque=10.0, n=1)
    result = retime(
        np.array([[0.0], [4.0]]),
        limits,
        period=PERIOD,
        inverse_dynamics=lambda q, dq, ddq: ddq,
        friction=lambda dq: 5.0 * np.sign(dq),
        options=Toppra(limit_jerk=False),
    )
    optimum = np.sqrt(2 * 4.0 * (1 / 5.0 + 1 / 15.0))
    # The short window at both ends and rounding to the period; symmetric profiles would take 1.79 s instead of 1.46 s.
    assert optimum <= result.duration_after <= optimum + 6 * PERIOD


def test_torque_that_cannot_hold_the_arm_is_infeasible():
    """Where gravity alone exceeds a torque limit the error says so, with joint and torque."""
    arm = _Arm()
    limits = _limits(20.0, 500.0, torque=np.array([5.0, 11.0]))
    path = np.array([[0.0, 0.0], [0.2, 0.4]])
    with pytest.raises(InfeasibleError, match="joint 1: gravity and friction alone need") as caught:
        retime(path, limits, period=PERIOD, inverse_dynamics=arm.rigid, friction=arm.friction)
    assert caught.value.joint == 1


def test_paths_that_make_no_sense_are_refused(limits):
    """A path that does not move, leaves the limits or has the wrong shape is an error, and so is a coarse grid."""
    with pytest.raises(InfeasibleError, match="no motion"):
        retime(np.zeros((5, 6)), limits, period=PERIOD)
    outside = np.zeros((2, 6))
    outside[1, 4] = 2.5
    with pytest.raises(InfeasibleError, match="joint 5"):
        retime(outside, limits, period=PERIOD)
    with pytest.raises(InputError, match="shape"):
        retime(np.zeros((5, 4)), limits, period=PERIOD)
    with pytest.raises(InputError, match="500"):
        Toppra(grid=100)


@pytest.mark.slow
def test_the_summary_says_what_happened(limits):
    """The summary names durations, the most used limit and its joint."""
    result = retime(_wave(seed=3), limits, period=PERIOD)
    name, joint, fraction = result.peak
    assert f"{name} limit of joint {joint}" in result.summary()
    assert 0.9 < fraction <= 1.0


def test_without_the_package_the_message_says_what_to_do(monkeypatch):
    """Where toppra is not installed, retiming names it and the method that works without."""
    monkeypatch.delitem(sys.modules, "oed.retiming.path_speed", raising=False)
    monkeypatch.setitem(sys.modules, "toppra", None)
    with pytest.raises(InputError, match=r"needs the package toppra.*--method ruckig"):
        retime(_wave(duration=2.0), _limits(1.0, 2.0, n=6), period=PERIOD)
