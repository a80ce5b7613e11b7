"""Clearances of all pairs with exact gradients on the 100 samples of a design, and a motion's proof, on one thread.

Run it with ``python benchmarks/collision.py``. Times are the best of several repetitions.
"""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Callable

import numpy as np

from oed.constraints.geometric import CollisionLimit, GeometricLimits
from oed.constraints.singularity import SingularityLimit
from oed.constraints.tool import ToolBox
from robots.collision import Box, CoalChecker, Scene, check_motion, collision_model, floor
from robots.common.errors import AssumedValueWarning
from robots.geometry.chain import homogeneous
from robots.loading import load_robot
from robots.signals import Motion

ROBOTS = ("er3a", "ur10", "panda")
SAMPLES = 100
GOAL = 1e-3  # of all pairs with gradients, 100 samples [s]


def best(run: Callable[[], object], repetitions: int = 200) -> float:
    """Best time of several runs [s], after one to warm up."""
    run()
    least = np.inf
    for _ in range(repetitions):
        start = time.perf_counter()
        run()
        least = min(least, time.perf_counter() - start)
    return least


def swing(home: np.ndarray) -> Motion:
    """Ten seconds at 1 kHz about a pose."""
    t = np.arange(10_001) * 1e-3
    w = 0.2 * np.pi * np.arange(1, len(home) + 1)
    q = home + 0.2 * np.sin(w * t[:, None])
    return Motion(t, q, 0.2 * w * np.cos(w * t[:, None]), -0.2 * w**2 * np.sin(w * t[:, None]))


def main() -> int:
    warnings.simplefilter("ignore", AssumedValueWarning)
    slowest = 0.0
    table = Box(name="table", size=[0.4, 0.6, 0.3], pose=homogeneous(np.eye(3), [0.7, 0.5, 0.15]))
    for name in ROBOTS:
        robot = load_robot(name)
        q = np.random.default_rng(0).uniform(robot.limits.lower, robot.limits.upper, (SAMPLES, robot.n))
        for text, obstacles in (("floor", (floor(0.0),)), ("floor and box", (floor(0.0), table))):
            model = collision_model(robot, scene=Scene(obstacles=obstacles))
            start = time.perf_counter()
            model.smooth_clearance(q)
            built = time.perf_counter() - start
            smooth = best(lambda model=model, q=q: model.smooth_clearance(q))
            judge = CoalChecker(model)
            coal = best(lambda judge=judge, q=q: judge.clearance(q), 5)
            slowest = max(slowest, smooth)
            print(
                f"{name:6s} {text:14s} {len(model.pairs):3d} pairs, {SAMPLES} samples: with gradients"
                f" {1e6 * smooth:6.0f} us (built or found in {built:.1f} s), coal without {1e6 * coal:6.0f} us"
            )
        model = collision_model(robot, scene=Scene(obstacles=(floor(0.0),)))
        limits = GeometricLimits(
            robot=robot,
            limits=(
                CollisionLimit(model=model),
                ToolBox(lower=(-1.0, -1.0, 0.0), upper=(1.0, 1.0, 2.0)),
                SingularityLimit(smallest=0.05),
            ),
        )
        whole = best(lambda limits=limits, q=q: limits.linearise(q))
        motion = swing(np.clip(np.zeros(robot.n), robot.limits.lower, robot.limits.upper))
        start = time.perf_counter()
        report = check_motion(model, motion, confirm=False)
        proof = time.perf_counter() - start
        print(
            f"{name:6s} with tool box and singularity, {limits.size} rows: {1e6 * whole:.0f} us;"
            f" 10 s at 1 kHz {'proved free' if report.certified else 'found not free'} in {1e3 * proof:.0f} ms"
        )
    print(f"\nslowest {1e6 * slowest:.0f} us, the goal is {1e6 * GOAL:.0f} us")
    return int(slowest > GOAL)


if __name__ == "__main__":
    sys.exit(main())
