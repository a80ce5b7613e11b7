"""Further experiments on the robot of a case, with the same effects, states and clock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from scipy.interpolate import make_interp_spline

from oed.benchmarks.truth.cases import Case
from oed.benchmarks.truth.dynamics import massless, rigid_torque, with_gravity, with_tool
from oed.benchmarks.truth.effects.base import Effect
from oed.benchmarks.truth.effects.surroundings import Tilt
from oed.benchmarks.truth.plant import LOG_PAUSE, Record, play
from oed.benchmarks.truth.references import Reference, Spline
from oed.benchmarks.truth.ride import Ride


@dataclass(frozen=True, kw_only=True)
class Stage:
    """One motion of an experiment.

    Args:
        t: time (N,) [s].
        q: positions (N, n) [rad].
        pause: rest before the motion [s].
        payload: point mass on the last link during the motion, 0.1 m along that link's z axis [kg].
        gravity: gravity (3,) in the frame of the base if it is tilted for the motion [m/s2]; else None.
    """

    t: np.ndarray
    q: np.ndarray
    pause: float = LOG_PAUSE
    payload: float = 0.0
    gravity: np.ndarray | None = None


@dataclass(frozen=True, kw_only=True)
class KnownChange(Effect):
    """A payload and a tilt of the base that the user sets between two times.

    An unknown tilt of the base on its mount remains when the mount is tilted. True gravity is therefore the rotation
    `turn` (3, 3) times the gravity that the user knows. It also acts on the payload.
    """

    stage: Stage
    start: float
    end: float
    turn: np.ndarray

    name = "known change"
    loads_gears = True

    def torque(self, ride: Ride) -> np.ndarray:
        rows = (ride.t >= self.start) & (ride.t <= self.end)
        motion = ride.link_q[rows], ride.link_v[rows], ride.link_a[rows]
        model = ride.machine.model
        torque = np.zeros_like(ride.q)
        known = model.gravity.linear if self.stage.gravity is None else self.stage.gravity
        if self.stage.gravity is not None:
            still = np.zeros_like(motion[0])
            change = with_gravity(model, self.turn @ (known - model.gravity.linear))
            torque[rows] += rigid_torque(change, motion[0], still, still)
        if self.stage.payload:
            point = pin.Inertia(float(self.stage.payload), np.array([0.0, 0.0, 0.1]), np.zeros((3, 3)))
            body = with_gravity(with_tool(massless(model), point), self.turn @ known)
            torque[rows] += rigid_torque(body, *motion)
        return torque


def follow_up(case: Case, stages: Sequence[Stage]) -> tuple[Record, ...]:
    """Simulates an experiment after a case's logs, which do not change, and returns only the new logs."""
    references = list(case.references[: case.training])
    clock = sum(reference.duration for reference in references) + LOG_PAUSE * (len(references) - 1)
    pauses = [LOG_PAUSE] * (len(references) - 1)
    changes = []
    turn = np.eye(3)
    for effect in case.effects:
        if isinstance(effect, Tilt):
            turn = effect.turn @ turn
    for stage in stages:
        reference = tabulated(stage.t, stage.q)
        references.append(reference)
        pauses.append(stage.pause)
        start = clock + stage.pause
        clock = start + reference.duration
        changes.append(KnownChange(stage=stage, start=start - stage.pause / 2, end=clock + 0.1, turn=turn))
    rng = np.random.default_rng([case.seed, 1])
    records = play(case.machine, references, [*case.effects, *changes], case.noise, rng, pause=pauses)
    return tuple(records[case.training :])


def tabulated(t: np.ndarray, q: np.ndarray) -> Reference:
    """Builds a reference through samples t (N,) [s], q (N, n) [rad] as a quintic spline, at rest before and after."""
    clock = np.asarray(t, dtype=float) - t[0]
    curve = Spline(curve=make_interp_spline(clock, q, k=5), start=0.0, end=float(clock[-1]))
    return Reference(duration=float(clock[-1]), period=None, kind="tabulated", curve=curve)
