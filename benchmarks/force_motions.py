"""False contacts in motions that neither the fit nor the healthy log has, and the forces of pushes of 10 to 300 N.

Run ``python benchmarks/force_motions.py [SEEDS [ARM ...]]``. Each seed draws an er3a, ur10 or panda whose masses,
lengths and frictions differ from the description by 10 %, with Stribeck friction that no fitted model has and 2 %
torque noise, half of it coloured. ur10 and panda, described without friction, get 6 % of each joint's largest torque.
The model comes from two motions of a minute, which repeat after 20 s; the threshold from three minutes of another such
motion. Judged are 27 minutes of other motions: three at that speed, a faster one, and two that do not repeat; and six
pushes of 0.3 s of each size at the flange, in random directions, by pinocchio's Jacobian. Beside them stand ten minutes
of point-to-point moves with stops of 0.2 to 5 s, at which friction holds any torque up to its Coulomb friction; the
threshold for these comes from three minutes of other such moves.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parent))

from forces import flange_jacobians, motion_of, plant_of

from benchmarks.monitoring_parts.stops import held_torque, moves_with_stops
from estimation import identify
from estimation.external_forces import ForceEstimate, estimate_forces
from estimation.uncertainty.quantiles import count_interval
from robots import Log, Motion, Robot, load_robot, simulate
from robots.common.errors import AssumedValueWarning, NotIdentifiableError

ARMS = ("er3a", "ur10", "panda")
SIZES = (10.0, 20.0, 40.0, 100.0, 200.0, 300.0)
PERIOD, LENGTH, EVERY = 0.008, 0.3, 20.0
# Coulomb friction, and viscous friction at the largest speed, over the largest torque.
FRICTION = 0.06
HARMONICS = 6
# Time after a push in which another contact counts as a part of it [s].
AFTER = 8.0


def periodic(robot: Robot, seed: int, duration: float, *, base: float = 0.05, speed: float = 0.7) -> Motion:
    """Draws a Fourier series per joint with that base frequency [Hz] and largest share of the speed limit."""
    rng, t = np.random.default_rng(seed), robot.period * np.arange(round(duration / robot.period))
    lower, upper = np.maximum(robot.limits.lower, -np.pi), np.minimum(robot.limits.upper, np.pi)
    order = np.arange(1, HARMONICS + 1)
    w, size = 2 * np.pi * base * order, rng.standard_normal((2, HARMONICS, robot.n)) / np.sqrt(order)[:, None]
    sine, cosine = np.sin(np.outer(t, w)), np.cos(np.outer(t, w))
    q = sine @ size[0] + cosine @ size[1]
    dq = cosine @ (w[:, None] * size[0]) - sine @ (w[:, None] * size[1])
    ddq = -sine @ (w[:, None] ** 2 * size[0]) - cosine @ (w[:, None] ** 2 * size[1])
    scale = np.minimum(
        speed * robot.limits.velocity / np.abs(dq).max(axis=0), 0.8 * (upper - lower) / np.ptp(q, axis=0)
    )
    middle = (lower + upper) / 2 - scale * (q.max(axis=0) + q.min(axis=0)) / 2
    return Motion(t, scale * q + middle, scale * dq, scale * ddq)


def with_stops(robot: Robot, seed: int, duration: float) -> Motion:
    """Draws moves from point to point."""
    t = robot.period * np.arange(round(duration / robot.period))
    lower, upper = np.maximum(robot.limits.lower, -np.pi), np.minimum(robot.limits.upper, np.pi)
    return Motion(t, *moves_with_stops(t, lower, upper, robot.limits.velocity, np.random.default_rng(seed)))


def held(robot: Robot, log: Log, motion: Motion, seed: int) -> Log:
    """Adds the torque that friction holds while a joint stands."""
    coulomb = np.asarray(robot.friction)[:, 0]
    return replace(log, tau=log.tau + held_torque(motion.dq, coulomb, np.random.default_rng([seed, 3])))


def robot_of(arm: str) -> Robot:
    """The arm with friction, and a period of 8 ms."""
    robot = replace(load_robot(arm), period=PERIOD)
    friction = np.array(robot.friction, dtype=float)
    if friction[:, 0].max() == 0.0:
        friction[:, 0] = FRICTION * robot.limits.torque
        friction[:, 1] = FRICTION * robot.limits.torque / robot.limits.velocity
        robot = replace(robot, friction=friction)
    return robot


@dataclass
class Tally:
    """Counts of one arm over its seeds."""

    false: int = 0
    hours: float = 0.0
    stop_false: int = 0
    stop_hours: float = 0.0
    refused: int = 0
    detected: dict[float, list[bool]] = field(default_factory=lambda: {size: [] for size in SIZES})
    events: dict[float, list[int]] = field(default_factory=lambda: {size: [] for size in SIZES})
    errors: dict[float, list[float]] = field(default_factory=lambda: {size: [] for size in SIZES})
    inside: dict[float, list[bool]] = field(default_factory=lambda: {size: [] for size in SIZES})

    def push(self, size: float, at: float, found: ForceEstimate) -> None:
        """Adds one push."""
        own = [c for c in found.contacts if at - LENGTH < c.start < at + AFTER]
        best = max((c for c in own if c.start < at + LENGTH and c.end > at), key=lambda c: c.peak, default=None)
        self.detected[size].append(best is not None)
        if best is not None:
            low, high = best.magnitude_interval
            self.events[size].append(len(own))
            self.errors[size].append(best.magnitude / size - 1)
            self.inside[size].append(low <= size <= high)

    def text(self) -> str:
        """Says false contacts, detections, events per push, errors and coverage."""
        lines = [f"{_rate(self.false, self.hours)}; {self.refused} logs with pushes refused"]
        lines.append(f"  moves with stops: {_rate(self.stop_false, self.stop_hours)}")
        for size in SIZES:
            known, errors = self.detected[size], np.array(self.errors[size])
            words = f"  {size:g} N: {sum(known)} of {len(known)} detected"
            if len(errors):
                words += f", {np.mean(self.events[size]):.2f} contacts each, size off by {100 * errors.mean():.1f} %"
                words += f" ± {100 * errors.std():.1f} %, {sum(self.inside[size])} inside their 95 % interval"
            lines.append(words)
        return "\n".join(lines)


def _rate(count: int, hours: float) -> str:
    """Says a count of false contacts and their rate with its 95 % interval."""
    low, high = (end / hours for end in count_interval(count))
    interval = f"{low:.1f} to {high:.1f}"
    return f"{count} false contacts in {hours:.2f} h: {count / hours:.1f} ({interval}) per hour"


def run_seed(arm: str, seed: int, tally: Tally) -> None:
    """Runs one virtual arm."""
    robot, first = robot_of(arm), 1000 * seed
    plant, rng = plant_of(robot, seed), np.random.default_rng([seed, 7])

    def log_of(motion: Motion, number: int) -> Log:
        return replace(simulate(plant, motion, seed=first + number), name=f"log {number}")

    model = identify(robot, [log_of(periodic(robot, first + k, 60.0), k) for k in (1, 2)]).model
    healthy = log_of(periodic(robot, first + 3, 180.0), 3)
    motions = [periodic(robot, first + k, 300.0) for k in (10, 11, 12)]
    motions.append(periodic(robot, first + 20, 120.0, base=0.1, speed=0.9))
    motions += [motion_of(robot, np.random.default_rng([seed, k]), 0.0, 300.0) for k in (0, 1)]
    calibration = None
    for k, motion in enumerate(motions):
        logs = {"healthy": [healthy]} if calibration is None else {"calibration": calibration}
        found = estimate_forces(model, log_of(motion, 30 + k), **logs)
        calibration = found.calibration
        tally.false += len(found.contacts)
        tally.hours += found.duration / 3600.0
    stops = []
    for k, duration in enumerate((180.0, 300.0, 300.0)):
        motion = with_stops(robot, first + 40 + k, duration)
        stops.append(held(robot, log_of(motion, 50 + k), motion, first + k))
    for log in stops[1:]:
        found = estimate_forces(model, log, healthy=[healthy, stops[0]])
        tally.stop_false += len(found.contacts)
        tally.stop_hours += found.duration / 3600.0
    for k, size in enumerate(SIZES):
        log = log_of(periodic(robot, first + 10, 120.0), 60 + k)
        tau, times = np.array(log.tau), []
        for begin in np.arange(EVERY / 2, 120.0 - AFTER, EVERY):
            times.append(float(begin + rng.uniform(0.0, AFTER)))
            direction = rng.normal(size=3)
            rows = np.flatnonzero((log.t >= times[-1]) & (log.t < times[-1] + LENGTH))
            force = size * direction / np.linalg.norm(direction)
            tau[rows] -= np.einsum("tkn,k->tn", flange_jacobians(robot, log.q[rows]), force)
        try:
            found = estimate_forces(model, replace(log, tau=tau), calibration=calibration)
        except NotIdentifiableError:
            tally.refused += 1
            continue
        for at in times:
            tally.push(size, at, found)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("seeds", nargs="?", type=int, default=2)
    parser.add_argument("arms", nargs="*", default=list(ARMS))
    options = parser.parse_args()
    warnings.simplefilter("ignore", AssumedValueWarning)
    for arm in options.arms:
        tally = Tally()
        for seed in range(options.seeds):
            run_seed(arm, seed, tally)
        print(f"{arm}, {options.seeds} robots: {tally.text()}", flush=True)


if __name__ == "__main__":
    main()
