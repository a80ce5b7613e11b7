"""The rigid-body regressor of a log: ours against a Python loop over pinocchio, on one thread.

Run it with ``python benchmarks/regressor.py``. Each figure is the best of several repetitions, in which the candidates
take turns, so that a busy moment of the machine hits all of them alike. None of them uses more than one thread.
"""

from __future__ import annotations

import platform
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from robots.batch.compiled import CompilerError, compiler
from robots.common.errors import AssumedValueWarning
from robots.loading import load_robot
from robots.regressor import TorqueModel
from robots.robot import Robot
from robots.terms import RigidBody

ROBOTS = ("er3a", "ur10", "panda")
SAMPLES = 20_000
REPETITIONS = 7
GOALS = {"compiled": 5.0, "vectorised": 1.5}

Array = NDArray[np.float64]


def processor() -> str:
    """Names the machine's processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    found = (line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    return next(found, platform.machine())


def pinocchio_loop(robot: Robot, q: Array, dq: Array, ddq: Array) -> Callable[[], Array]:
    """What one writes without us: pinocchio's regressor, sample after sample, into one array."""
    model, parent = pin.Model(), 0
    model.gravity.linear = np.array(robot.chain.gravity)
    for joint in robot.chain.joints:
        # The joint models for coordinate axes are pinocchio's fastest; all robots here have them.
        (axis,) = np.flatnonzero(joint.axis == 1.0)
        kind = (pin.JointModelRX, pin.JointModelRY, pin.JointModelRZ)[axis]
        placement = pin.SE3(np.array(joint.rotation), np.array(joint.translation))
        parent = model.addJoint(parent, kind(), placement, joint.name)
    data = model.createData()
    out = np.empty((len(q), robot.n, 10 * robot.n))

    def run() -> Array:
        compute = pin.computeJointTorqueRegressor
        for k in range(len(q)):
            out[k] = compute(model, data, q[k], dq[k], ddq[k])
        return out

    return run


def candidates(robot: Robot) -> dict[str, Callable[[], Array]]:
    """The ways to the same regressor, the reference first."""
    q, dq, ddq = np.random.default_rng(0).uniform(-3, 3, (3, SAMPLES, robot.n))
    model = TorqueModel(robot, (RigidBody(),))
    out = np.empty((SAMPLES, robot.n, 10 * robot.n))
    ways = {"pinocchio": pinocchio_loop(robot, q, dq, ddq)}
    for backend in GOALS:
        ways[backend] = lambda b=backend: model.regressor(q, dq, ddq, backend=b)
        ways[f"{backend}, out"] = lambda b=backend: model.regressor(q, dq, ddq, backend=b, out=out)
    return ways


def measure(ways: dict[str, Callable[[], Array]]) -> dict[str, float]:
    """Best time [s] of each, after one run to warm up."""
    expected = ways["pinocchio"]()
    order = [10 * link + k for link in range(expected.shape[1]) for k in (0, 1, 2, 3, 4, 5, 7, 6, 8, 9)]
    for name, way in ways.items():
        if name != "pinocchio" and not np.allclose(way(), expected[:, :, order], rtol=0, atol=1e-9):
            raise SystemExit(f"{name} computes something else")
    best = dict.fromkeys(ways, np.inf)
    for _ in range(REPETITIONS):
        for name, way in ways.items():
            start = time.perf_counter()
            way()
            best[name] = min(best[name], time.perf_counter() - start)
    return best


def main() -> int:
    warnings.simplefilter("ignore", AssumedValueWarning)
    print(f"{processor()}; Python {platform.python_version()}, pinocchio {pin.__version__}; one thread")
    print(f"{SAMPLES} samples, best of {REPETITIONS}; microseconds a sample, and times as fast as the pinocchio loop\n")
    try:
        compiler()
    except CompilerError as error:
        print(f"without the compiled evaluator: {error}\n")
        del GOALS["compiled"]
    worst = dict.fromkeys(GOALS, np.inf)
    for name in ROBOTS:
        best = measure(candidates(load_robot(name)))
        cells = []
        for way, seconds in best.items():
            ratio = best["pinocchio"] / seconds
            backend = way.split(",")[0]
            worst[backend] = min(worst.get(backend, np.inf), ratio)
            cells.append(f"{way} {1e6 * seconds / SAMPLES:.2f}" + (f" ({ratio:.1f}x)" if way != "pinocchio" else ""))
        print(f"{name:6s} " + "   ".join(cells))
    print()
    for backend, goal in GOALS.items():
        print(f"{backend}: {worst[backend]:.1f}x at the least, the goal is {goal:g}x")
    return int(any(worst[backend] < goal for backend, goal in GOALS.items()))


if __name__ == "__main__":
    sys.exit(main())
