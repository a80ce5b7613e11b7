"""Feedback that leaves the plan ends the motion soon, and feedback as drives and networks make it does not."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from oed.controllers.clients.watching import PathWatch, TimedWatch, Watch
from oed.controllers.errors import ControllerError
from robots.signals import Motion

Array = NDArray[np.float64]

N, DURATION, TOLERANCE = 6, 6.0, 0.05
SOON = 0.2
"""A fault ends the motion so long after the robot has left the tolerance, at the latest [s]."""
LONGEST_LAG = 150
"""Of a drive, and of finding its first movement [ms]."""

UNITS = ["rad"] * N


def plan(rng: np.random.Generator) -> Motion:
    """A motion as a design makes it: four harmonics in each joint, faded in and out, up to 2.5 rad/s."""
    t = np.arange(0.0, DURATION + 1e-9, 0.004)
    w = 2 * np.pi * 0.3 * np.arange(1, 5)
    a, b = rng.normal(size=(2, N, 4)) / np.arange(1, 5)
    q = a @ np.sin(np.outer(w, t)) + b @ np.cos(np.outer(w, t))
    q *= np.sin(np.pi * t / DURATION) ** 2
    q *= rng.uniform(0.5, 2.5, (N, 1)) / np.abs(np.gradient(q, t, axis=1)).max(axis=1, keepdims=True)
    q = q.T + rng.uniform(-1, 1, N)
    dq = np.gradient(q, t, axis=0)
    return Motion(t, q, dq, np.gradient(dq, t, axis=0))


class Machine:
    """What a robot does with a plan: it starts late, its drives lag, its brakes sag, its clock drifts."""

    def __init__(self, rng: np.random.Generator, motion: Motion) -> None:
        self.t = np.arange(-1.0, DURATION + 1.5, 0.001)
        self.start = rng.uniform(0.0, 100.0)
        planned = np.column_stack([np.interp(self.t * (1 + 2e-4), motion.t, motion.q[:, j]) for j in range(N)])
        self.q = np.empty_like(planned)
        self.q[0] = planned[0]
        follow = 0.001 / rng.uniform(0.005, 0.04, N)
        for k in range(1, len(self.t)):
            self.q[k] = self.q[k - 1] + follow * (planned[k] - self.q[k - 1])
        sag = np.where(self.t > rng.uniform(-0.5, -0.3), 1e-3, 0.0)
        self.q[:, 1] += sag * rng.uniform(-1, 1)


def rows(rng: np.random.Generator, machine: Machine, stamped: bool, period: float) -> Iterator[tuple[float, Array]]:
    """Feedback of a machine over a network: 5 % of the messages come 50 ms late."""
    sent = np.arange(machine.t[0], machine.t[-1], period)
    late = np.where(rng.random(len(sent)) < 0.05, 0.05, 0.0) + 1e-3 * rng.exponential(size=len(sent))
    newest = -np.inf
    for k in np.argsort(sent + late):
        place = min(int((sent[k] - machine.t[0]) / 0.001 + 0.5), len(machine.t) - 1)
        q = np.round((machine.q[place] + 2e-5 * rng.normal(size=N)) / 1e-5) * 1e-5
        if not stamped:
            yield machine.start + sent[k] + late[k], q
        elif sent[k] > newest:
            newest = sent[k]
            yield machine.start + sent[k], q


def ended(watch: Watch, feedback: Iterator[tuple[float, Array]]) -> tuple[float, str]:
    """When a watch ends a motion, on the clock of the feedback, and its message; infinity where it does not."""
    for s, q in feedback:
        try:
            watch.see(s, q)
        except ControllerError as error:
            return s, str(error)
    return np.inf, ""


@pytest.mark.slow
@pytest.mark.parametrize("stamped", [True, False])
@pytest.mark.parametrize(
    ("kind", "runs"), [(TimedWatch, 25), pytest.param(TimedWatch, 100, marks=pytest.mark.longer), (PathWatch, 25)]
)
def test_clean_runs_go_on(kind: type[Watch], runs: int, stamped: bool) -> None:
    """Runs with drives that lag, brakes that sag, a clock that drifts and late messages end at their end."""
    for seed in range(runs):
        rng = np.random.default_rng(seed)
        motion = plan(rng)
        feedback = rows(rng, Machine(rng, motion), stamped, rng.choice([0.008, 0.012, 0.025]))
        assert ended(kind(motion, np.full(N, TOLERANCE), UNITS), feedback) == (np.inf, "")


def swap(q: Array, before: int, rng: np.random.Generator) -> Array:
    """Two joints are in each other's place."""
    q = q - q[before]
    q[:, [0, 1]] = q[:, [1, 0]]
    return q


def sign(q: Array, before: int, rng: np.random.Generator) -> Array:
    """One joint counts the other way."""
    return (q - q[before]) * np.where(np.arange(N) == 2, -1.0, 1.0)


def half_speed(q: Array, before: int, rng: np.random.Generator) -> Array:
    """The controller plays at half of the speed."""
    places = before + (np.arange(len(q)) - before) / 2
    return np.column_stack([np.interp(places, np.arange(len(q)), q[:, j]) for j in range(N)]) - q[before]


def stall(q: Array, before: int, rng: np.random.Generator) -> Array:
    """The robot stands still for five seconds."""
    places = before + np.maximum(np.arange(len(q)) - before - 5000, 0)
    return q[np.minimum(places, len(q) - 1)] - q[before]


def offset(q: Array, before: int, rng: np.random.Generator) -> Array:
    """One encoder jumps."""
    return q - q[before] + np.where(np.arange(N) == 4, 0.1, 0.0)


def other_robot(q: Array, before: int, rng: np.random.Generator) -> Array:
    """The axes are those of another robot: other gears, and a coupled wrist."""
    return (q - q[before]) @ (np.diag(rng.uniform(0.5, 0.8, N)) + 0.3 * np.eye(N, k=1))


FAULTS: list[Callable[[Array, int, np.random.Generator], Array]] = [swap, sign, half_speed, stall, offset, other_robot]


def test_slow_feedback() -> None:
    """Feedback that comes once a second ends no clean run, though it shows the first movement late."""
    for seed in range(30):
        rng = np.random.default_rng(seed)
        motion = plan(rng)
        slow = Motion(4 * motion.t, motion.q, motion.dq / 4, motion.ddq / 16)
        machine = Machine(rng, motion)
        machine.t = 4 * machine.t
        watch = TimedWatch(slow, np.full(N, TOLERANCE), UNITS)
        for place in range(int(rng.integers(1000)) % 250, len(machine.t), 250):
            watch.see(machine.start + machine.t[place], machine.q[place])


@pytest.mark.parametrize("stamped", [True, False])
@pytest.mark.parametrize("fault", FAULTS)
def test_faults_end_the_motion(fault: Callable[..., Array], stamped: bool) -> None:
    """A fault in the middle ends the motion within 0.2 s of leaving the tolerance, with joint, time and positions."""
    for seed in range(10):
        rng = np.random.default_rng(seed)
        motion = plan(rng)
        machine = Machine(rng, motion)
        clean = machine.q.copy()
        before = int(rng.uniform(2.0, 3.5) * 1000)
        machine.q[before:] = (clean[before] + fault(clean, before, rng))[before:]
        away = np.abs(machine.q - clean).max(axis=1) > TOLERANCE
        left = machine.start + machine.t[away.argmax()]
        when, message = ended(
            TimedWatch(motion, np.full(N, TOLERANCE), UNITS), rows(rng, machine, stamped, rng.choice([0.004, 0.012]))
        )
        assert when <= left + SOON
        assert "of the trajectory it is at" in message
        assert "the plan is" in message
        assert "joint" in message


@pytest.mark.parametrize("fault", [swap, sign, half_speed, other_robot])
def test_faults_from_the_beginning(fault: Callable[..., Array]) -> None:
    """A fault from the first movement on is stopped as soon once no lag explains it that a drive may have."""
    for seed in range(10):
        rng = np.random.default_rng(seed)
        motion = plan(rng)
        machine = Machine(rng, motion)
        clean = machine.q.copy()
        machine.q[1000:] = (clean[1000] + fault(clean, 1000, rng))[1000:]
        lags = range(-LONGEST_LAG, LONGEST_LAG + 1, 10)
        away = np.min([np.abs(machine.q - np.roll(clean, lag, axis=0)) for lag in lags], axis=0)
        lasting = np.convolve((away > TOLERANCE).any(axis=1), np.ones(50), "valid") == 50
        when, _ = ended(TimedWatch(motion, np.full(N, TOLERANCE), UNITS), rows(rng, machine, True, 0.004))
        assert when <= machine.start + machine.t[lasting.argmax()] + SOON


@pytest.mark.parametrize("fault", [swap, sign, offset, other_robot])
def test_faults_of_a_path(fault: Callable[..., Array]) -> None:
    """A controller that plays in its own time is ended where it leaves the path, half as fast or not."""
    rng = np.random.default_rng(0)
    motion = plan(rng)
    slow = Motion(2 * motion.t, motion.q, motion.dq / 2, motion.ddq / 4)
    for played in (motion, slow):
        machine = Machine(rng, played)
        watch = PathWatch(motion, np.full(N, TOLERANCE), UNITS)
        assert ended(watch, rows(rng, machine, False, 0.025))[0] == np.inf
        machine.q[2500:] = (machine.q[2500] + fault(machine.q, 2500, rng))[2500:]
        watch = PathWatch(motion, np.full(N, TOLERANCE), UNITS)
        assert ended(watch, rows(rng, machine, False, 0.025))[0] < np.inf


def test_joints_that_are_not_watched() -> None:
    """A tolerance of infinity leaves a joint out."""
    rng = np.random.default_rng(0)
    motion = plan(rng)
    machine = Machine(rng, motion)
    machine.q[3000:, 4] += 0.5
    tolerance = np.full(N, TOLERANCE)
    assert ended(TimedWatch(motion, tolerance, UNITS), rows(rng, machine, True, 0.004))[0] < np.inf
    tolerance[4] = np.inf
    assert ended(TimedWatch(motion, tolerance, UNITS), rows(rng, machine, True, 0.004))[0] == np.inf
