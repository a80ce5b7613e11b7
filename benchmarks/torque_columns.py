"""Torque columns of another meaning: how many the gate names, and how many right logs it names wrongly.

Virtual er3a, ur10, panda and two small arms play random motions. Their links, frictions and rotors differ from the
description by 20 % (lognormal), and each has friction and torque noise of 2 %. The torque column is then replaced by
what other sources write: currents, motor torques of single joints, torques without gravity, targets of a controller,
external torques, filtered or delayed torques.

    python benchmarks/torque_columns.py --seeds 20
"""

from __future__ import annotations

import argparse
import platform
import time
import warnings
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from estimation.gate import GateReport, check_log
from robots.geometry.chain import Chain, Joint
from robots.limits import Limits
from robots.loading import load_robot
from robots.plants import Plant, Sensors, nominal_plant, simulate
from robots.robot import Robot
from robots.signals import Log, Motion

Array = NDArray[np.float64]

SPREAD, NOISE, PERIOD, DURATION = 0.2, 0.02, 0.004, 20.0
ROBOTS = ("er3a", "ur10", "panda", "planar arm", "upright arm")
KINDS = (
    "right",
    "current",
    "current, one factor",
    "motor",
    "gravity compensated",
    "gravity of the description compensated",
    "target",
    "external",
    "external with friction",
    "filtered",
    "delayed",
)
NAMED = {
    "current": "current",
    "current, one factor": "current",
    "motor": "motor",
    "gravity compensated": "without gravity",
    "gravity of the description compensated": "without gravity",
    "target": "target",
    "external": "external",
    "external with friction": "external",
    "filtered": "delay",
    "delayed": "delay",
}


@dataclass(frozen=True)
class Trial:
    """One log with a known meaning, and what the gate says of its torques."""

    robot: str
    kind: str
    seed: int
    said: frozenset[str]

    @property
    def right(self) -> bool:
        """Whether the kind is named; of a right log, whether nothing is."""
        return not self.said if self.kind == "right" else NAMED[self.kind] in self.said


def described(name: str) -> Robot:
    """Gives a robot with friction: the catalogue's, or a small arm."""
    if name in ("planar arm", "upright arm"):
        return _small_arm(upright=name == "upright arm")
    robot = load_robot(name)
    if np.any(robot.friction):
        return robot
    torque = np.asarray(robot.limits.torque, dtype=float)
    friction = np.zeros((robot.n, 4))
    friction[:, 0], friction[:, 1] = 0.03 * torque, 0.03 * torque / np.asarray(robot.limits.velocity)
    return replace(robot, friction=friction)


def _small_arm(*, upright: bool) -> Robot:
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    joints = [
        Joint("shoulder", "revolute", turn, np.array([0.0, 0.0, 0.1])),
        Joint("elbow", "revolute", np.eye(3), np.array([0.3, 0.0, 0.0])),
    ]
    links = [
        [1.2, 0.18, 0.01, 0.0, 0.002, 0.0, 0.0, 0.036, 0.0, 0.036],
        [0.7, 0.09, 0, 0.01, 0.001, 0, 0, 0.016, 0, 0.016],
    ]
    if upright:
        joints.insert(0, Joint("base", "revolute", np.eye(3), np.zeros(3)))
        links.insert(0, [2.0, 0.0, 0.02, 0.1, 0.02, 0, 0, 0.02, 0, 0.01])
    n = np.ones(len(joints))
    return Robot(
        name="small",
        chain=Chain(tuple(joints)),
        limits=Limits(lower=-2.5 * n, upper=2.5 * n, velocity=5 * n, acceleration=40 * n, jerk=900 * n, torque=12 * n),
        inertia=np.array(links),
        rotor_inertia=0.01 * n,
        friction=np.column_stack([0.25 * n, 0.1 * n, 0 * n, 0 * n]),
        gear_ratio=50 * n,
    )


def motion_of(robot: Robot, seed: int) -> Motion:
    """Makes a random motion of five harmonics, within 0.8 of the ranges and 0.6 of the velocities."""
    rng = np.random.default_rng([seed, 17])
    t = PERIOD * np.arange(round(DURATION / PERIOD))
    w = 2 * np.pi * 0.1 * np.arange(1, 6)
    a, b = rng.normal(size=(2, 5, robot.n))
    s, c = np.sin(np.outer(t, w)), np.cos(np.outer(t, w))
    q, dq, ddq = s @ (a / w[:, None]) - c @ (b / w[:, None]), c @ a + s @ b, c @ (b * w[:, None]) - s @ (a * w[:, None])
    lower, upper = np.maximum(robot.limits.lower, -np.pi), np.minimum(robot.limits.upper, np.pi)
    scale = np.minimum(0.8 * (upper - lower) / np.ptp(q, axis=0), 0.6 * robot.limits.velocity / np.abs(dq).max(axis=0))
    middle = (lower + upper) / 2 - scale * (q.max(axis=0) + q.min(axis=0)) / 2
    return Motion(t=t, q=scale * q + middle, dq=scale * dq, ddq=scale * ddq)


def log_of(robot: Robot, kind: str, seed: int) -> Log:
    """Simulates a log whose torque column has a meaning."""
    motion, rng = motion_of(robot, seed), np.random.default_rng([seed, 23])
    noisy = Sensors(torque_noise=NOISE)

    def plant(of: Robot, sensors: Sensors = noisy) -> Plant:
        return nominal_plant(of, friction="coulomb-viscous", sensors=sensors, spread=SPREAD, seed=seed)

    truth = plant(robot)
    log = simulate(truth, motion, seed=seed)
    tau = np.array(log.tau)
    silent = Sensors(encoder_counts=0.0, torque_noise=0.0)
    smooth = replace(robot, friction=np.zeros((robot.n, 4)), rotor_inertia=np.zeros(robot.n))
    if kind.startswith("current"):
        factors = np.exp(rng.uniform(np.log(3), np.log(20), robot.n if kind == "current" else 1))
        tau /= factors
    elif kind == "motor":
        gears = np.where(np.abs(robot.gear_ratio) > 2, np.abs(robot.gear_ratio), 100.0)
        heavy = np.argsort(-tau.std(axis=0))[: max(2, robot.n // 2)]
        chosen = rng.choice(heavy, 1)
        tau[:, chosen] /= gears[chosen]
    elif kind == "gravity compensated":
        tau = np.array(replace(simulate(plant(robot.under(np.zeros(3))), motion, seed=seed)).tau)
    elif kind == "gravity of the description compensated":
        still = replace(motion, dq=np.zeros_like(motion.dq), ddq=np.zeros_like(motion.ddq))
        tau -= np.asarray(simulate(nominal_plant(smooth, sensors=silent), still).tau)
    elif kind == "target":
        tau = np.array(simulate(plant(smooth, silent), motion).tau)
    elif kind.startswith("external"):
        moved = robot if kind.endswith("friction") else replace(robot, friction=smooth.friction)
        own = simulate(plant(replace(moved, rotor_inertia=smooth.rotor_inertia), silent), motion).tau
        controller = nominal_plant(smooth, friction="coulomb-viscous", sensors=silent, spread=0.1, seed=seed + 1000)
        own_rigid = nominal_plant(smooth, friction="coulomb-viscous", sensors=silent, spread=SPREAD, seed=seed)
        # The controller's model is 10 % off the truth.
        inertia = (
            own_rigid.parameters
            * controller.parameters
            / _nonzero(nominal_plant(smooth, friction="coulomb-viscous", sensors=silent).parameters)
        )
        modelled = simulate(replace(own_rigid, parameters=inertia), motion).tau
        tau = np.asarray(own) - np.asarray(modelled) + 0.005 * tau.std(axis=0) * rng.normal(size=tau.shape)
    elif kind == "filtered":
        share = 1 - np.exp(-2 * np.pi * rng.uniform(3, 8) * PERIOD)
        tau = lfilter([share], [1, share - 1], tau - tau[0], axis=0) + tau[0]
    elif kind == "delayed":
        rows = round(rng.uniform(0.012, 0.04) / PERIOD)
        tau = np.vstack([np.repeat(tau[:1], rows, axis=0), tau[:-rows]])
    return Log(log.t, log.q, tau=tau)


def _nonzero(values: Array) -> Array:
    return np.where(values == 0, 1.0, values)


def said_by(report: GateReport) -> frozenset[str]:
    """Lists the meanings that the gate names, and the findings that are wrong beside them."""
    said = set()
    for finding in report.findings:
        if finding.name == "torque_meaning":
            words = ("current", "motor", "without gravity", "target", "external", "unit")
            said |= {word for word in words if word in finding.text}
        elif (
            finding.name in ("delay", "gravity_direction", "swapped_columns", "torque_sign", "unit_of_torque")
            or finding.severity == "refuse"
        ):
            said.add(finding.name)
    return frozenset(said)


def trials(robots: tuple[str, ...], kinds: tuple[str, ...], seeds: range) -> Iterator[Trial]:
    """Runs all trials."""
    for name in robots:
        robot = described(name)
        without_friction = replace(robot, friction=np.zeros((robot.n, 4)))
        for kind in kinds:
            for seed in seeds:
                yield Trial(name, kind, seed, said_by(check_log(without_friction, log_of(robot, kind, seed))))


def main() -> None:
    """Prints the share of each kind that is named, and of right logs that are named wrongly."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--robots", nargs="*", default=ROBOTS)
    parser.add_argument("--kinds", nargs="*", default=KINDS)
    chosen = parser.parse_args()
    seeds = range(chosen.first_seed, chosen.first_seed + chosen.seeds)
    warnings.simplefilter("ignore")
    print(f"{platform.processor() or platform.machine()}, Python {platform.python_version()}; {chosen.seeds} seeds")
    started = time.perf_counter()
    right: Counter[tuple[str, str]] = Counter()
    for trial in trials(tuple(chosen.robots), tuple(chosen.kinds), seeds):
        right[trial.robot, trial.kind] += trial.right
        if not trial.right:
            print(f"  {trial.robot}, {trial.kind}, seed {trial.seed}: said {sorted(trial.said)}", flush=True)
    print(f"{'kind':40} {' '.join(f'{name:>12}' for name in chosen.robots)} {'all':>8}")
    for kind in chosen.kinds:
        counts = [right[name, kind] for name in chosen.robots]
        share = 100 * sum(counts) / (len(counts) * chosen.seeds)
        print(f"{kind:40} {' '.join(f'{count:9}/{chosen.seeds:2}' for count in counts)} {share:7.1f}%")
    print(f"{time.perf_counter() - started:.0f} s")


if __name__ == "__main__":
    main()
