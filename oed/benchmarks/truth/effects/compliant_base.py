"""A base on springs, whose tilt is integrated with the robot's own motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from scipy.interpolate import interp1d

from oed.benchmarks.truth.dynamics import rigid_torque
from oed.benchmarks.truth.effects.base import Effect
from oed.benchmarks.truth.machines import Machine
from oed.benchmarks.truth.ride import Ride

Motion = tuple[np.ndarray, ...]


@dataclass(frozen=True, kw_only=True)
class LeaningBase(Effect):
    """A base that rotates about its x and y axes on springs with the compliance `amount` [rad/(N m)].

    The robot's joints follow their motion, and the base is accelerated by what is left of the robot's moments. It has
    the mass moment of inertia `own` times the robot's and the damping ratio `damping`. `ratio` is the compliance about
    y over that about x.
    """

    ratio: float = 1.0
    own: float = 0.1
    damping: float = 0.04

    name = "base_compliance"
    largest = 1e-3
    power = 0.5

    @classmethod
    def joints(cls, machine: Machine) -> tuple[int | None, ...]:
        return (None,)

    @classmethod
    def draw(cls, machine: Machine, rng: np.random.Generator, joint: int | None, span: float) -> LeaningBase:
        return cls(ratio=rng.uniform(0.5, 2.0), own=rng.uniform(0.02, 0.2), damping=rng.uniform(0.02, 0.08))

    def torque(self, ride: Ride) -> np.ndarray:
        # A step of the integration takes 2 ms; a base with a faster resonance follows its load.
        model, every = ride.machine.model, max(round(0.002 / ride.step), 1)
        poses = ride.link_q[:: max(len(ride.q) // 50, 1)]
        inertia = float(np.mean([_about_base(model, q) for q in poses]))
        whole = _on_two_axes(model, self.own * inertia)
        stiffness = np.array([1.0, 1.0 / self.ratio]) / self.amount
        resonance = np.sqrt(stiffness / inertia) / (2 * np.pi)
        # A base that resonates above 30 Hz does not ring: smoothed logs do not contain it.
        lost = 2 * np.where(resonance < 30.0, self.damping, 1.0) * np.sqrt(stiffness * inertia)
        torque = np.empty_like(ride.q)
        for run in ride.runs:
            rows = np.unique(np.r_[run.start : run.stop : every, run.stop - 1])
            motion = tuple(values[rows] for values in (ride.link_q, ride.link_v, ride.link_a))
            tilt = _integrated(whole, stiffness, lost, np.diff(ride.t[rows]), motion)
            thin = _torque(whole, tilt, motion) - _torque(whole, np.zeros_like(tilt), motion)
            torque[run] = interp1d(ride.t[rows], thin, axis=0, kind="cubic")(ride.t[run])
        return torque

    def truths(self) -> dict[str, float]:
        return {"compliance_1": self.amount, "compliance_2": self.amount * self.ratio}


def _about_base(model: pin.Model, q: np.ndarray) -> float:
    """Returns the robot's mean inertia about the horizontal axes through its base [kg m2]."""
    data = model.createData()
    pin.ccrba(model, data, q, np.zeros(model.nv))
    body, centre = data.Ig, data.com[0]  # the inertia is that about the centre of mass
    about = body.inertia + body.mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    return float((about[0, 0] + about[1, 1]) / 2)


def _on_two_axes(model: pin.Model, own: float) -> pin.Model:
    """Puts the robot on a joint about x and one about y; the upper body has an inertia of its own [kg m2]."""
    base = pin.Model()
    about_x = base.addJoint(0, pin.JointModelRX(), pin.SE3.Identity(), "base_x")
    about_y = base.addJoint(about_x, pin.JointModelRY(), pin.SE3.Identity(), "base_y")
    base.appendBodyToJoint(about_y, pin.Inertia(1e-6, np.zeros(3), own * np.eye(3)), pin.SE3.Identity())
    frame = base.addFrame(pin.Frame("top", about_y, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    whole = pin.appendModel(base, model, frame, pin.SE3.Identity())
    whole.gravity.linear = model.gravity.linear
    return whole


def _torque(whole: pin.Model, tilt: np.ndarray, motion: Motion) -> np.ndarray:
    """Computes the joints' torque (N, n) with tilts, their rates and accelerations (3, N, 2)."""
    states = [np.ascontiguousarray(np.hstack(pair)) for pair in zip(tilt, motion, strict=True)]
    return rigid_torque(whole, *states)[:, 2:]


def _integrated(
    whole: pin.Model, stiffness: np.ndarray, lost: np.ndarray, steps: np.ndarray, motion: Motion
) -> np.ndarray:
    """Integrates tilts, their rates and accelerations (3, N, 2) along a motion with its time steps (N - 1,).

    A log may begin in the middle of a motion, where the base has stopped to ring by its start. Its state there is that
    of a base that comes to this row backwards in time, along the first part of the log.
    """
    q, v, a = motion
    rest = np.zeros(whole.nv)
    # Rows after which a base that was at rest rings no more.
    lead = 3000
    rest[2:] = q[:lead][-1]
    # The tilt at rest changes the load itself, and settles in these rounds.
    for _ in range(20):
        rest[:2] = -pin.rnea(whole, whole.createData(), rest, 0 * rest, 0 * rest)[:2] / stiffness
    back = tuple(values[:lead][::-1] for values in (q, -v, a))
    start = _steps(whole, stiffness, lost, steps[: lead - 1][::-1], back, (rest[:2], np.zeros(2), np.zeros(2)))
    tilt, rate, curve = start[:, -1]
    return _steps(whole, stiffness, lost, steps, motion, (tilt, -rate, curve))


def _steps(
    whole: pin.Model,
    stiffness: np.ndarray,
    lost: np.ndarray,
    steps: np.ndarray,
    motion: Motion,
    start: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> np.ndarray:
    """Integrates from a start by the rule of average acceleration (Newmark 1959), springs and dampers implicit."""
    data, q, v, a = whole.createData(), *motion
    x, y, z = (np.zeros(whole.nv) for _ in range(3))
    tilt, rate, curve = start
    result = np.zeros((3, len(q), 2))
    result[:, 0] = start
    for k, h in enumerate(steps.tolist(), start=1):
        tilt = tilt + h * rate + h * h / 4 * curve
        rate = rate + h / 2 * curve
        x[:2], x[2:], y[:2], y[2:], z[2:] = tilt, q[k], rate, v[k], a[k]
        push = -pin.rnea(whole, data, x, y, z)[:2] - stiffness * tilt - lost * rate
        M = pin.crba(whole, data, x)
        left = h / 2 * lost + h * h / 4 * stiffness
        one, other, both = M[0, 0] + left[0], M[1, 1] + left[1], M[0, 1]
        curve = np.array([other * push[0] - both * push[1], one * push[1] - both * push[0]])
        curve /= one * other - both * both
        tilt = tilt + h * h / 4 * curve
        rate = rate + h / 2 * curve
        result[:, k] = tilt, rate, curve
    return result
