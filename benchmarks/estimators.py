"""All estimators on the same simulated logs: parameters, unseen torque, CPU time; and the semidefinite program alone.

Run it with ``python benchmarks/estimators.py [LOGS]``. Each log is a random Fourier motion of 20 s at 250 Hz of a
virtual robot that is 10 % off its description. Three kinds of trouble: torque noise of 2 %, half of it coloured;
besides, one sample in fifty hit by three standard deviations of torque; besides the first, positions known to a coarse
encoder only. Parameter errors are weighed by the torque that they make: each error times the RMS of its column over its
joint's torque RMS, RMS over all base parameters, in per cent. Torque errors are over the torque's RMS, mean of all
joints, on another motion and against the truth.
"""

from __future__ import annotations

import sys
import time
import warnings
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimation import identify
from estimation.estimators import ESTIMATORS, PhysicallyConsistent, RegressionData
from estimation.regressions.moments import Moments
from estimation.regressions.preparation import Rows
from robots import load_robot, nominal_plant, simulate
from robots.base_parameters import find_base_parameters
from robots.common.errors import AssumedValueWarning, OedError
from robots.plants import Plant, Sensors
from robots.robot import Robot
from robots.signals import Log, Motion

Array = NDArray[np.float64]

ROBOTS = ("er3a", "ur10", "panda")
LOGS = 3
DURATION, PERIOD, HARMONICS, BASE_FREQUENCY = 20.0, 0.004, 5, 0.1
HIT_SHARE, HIT_SIZE = 0.02, 3.0
COARSE = 5e-4  # encoder step at the joint [rad or m]


@dataclass(frozen=True)
class Trouble:
    """What a log suffers from."""

    name: str
    sensors: Sensors
    hits: bool = False
    coarse: bool = False


TROUBLES = (
    Trouble("noise", Sensors()),
    Trouble("outliers", Sensors(), hits=True),
    Trouble("coarse encoder", Sensors(), coarse=True),
)


def fourier_motion(robot: Robot, seed: int) -> Motion:
    """Draws a Fourier motion that uses 0.9 of the range or 0.7 of the velocity, whichever is less."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(DURATION / PERIOD)) * PERIOD
    w = 2 * np.pi * BASE_FREQUENCY * np.arange(1, HARMONICS + 1)
    a, b = rng.normal(size=(2, HARMONICS, robot.n))
    s, c = np.sin(np.outer(t, w)), np.cos(np.outer(t, w))
    q, dq, ddq = s @ (a / w[:, None]) - c @ (b / w[:, None]), c @ a + s @ b, c @ (b * w[:, None]) - s @ (a * w[:, None])
    lower, upper = np.maximum(robot.limits.lower, -np.pi), np.minimum(robot.limits.upper, np.pi)
    scale = np.minimum(0.9 * (upper - lower) / np.ptp(q, axis=0), 0.7 * robot.limits.velocity / np.abs(dq).max(axis=0))
    middle = (lower + upper) / 2 - scale * (q.max(axis=0) + q.min(axis=0)) / 2
    return Motion(t=t, q=scale * q + middle, dq=scale * dq, ddq=scale * ddq)


def plant_of(name: str, sensors: Sensors) -> Plant:
    """Builds the virtual robot; drives that nobody describes get plausible ones."""
    robot = load_robot(name)
    if not robot.friction.any():
        strength = np.array([12.0, 12.0, 8.0, 3.0, 3.0, 3.0, 3.0])[: robot.n]
        robot = replace(
            robot,
            friction=strength[:, None] * np.array([1.0, 0.8, 0.0, 0.0]),
            rotor_inertia=0.15 * strength,
            gear_ratio=np.full(robot.n, 100.0),
        )
    return nominal_plant(robot, sensors=sensors, spread=0.1, seed=1)


def spoilt(log: Log, trouble: Trouble, seed: int) -> Log:
    """Hits some samples, as collisions and lost messages do, all to one side; rounds positions."""
    assert log.tau is not None
    rng = np.random.default_rng(seed)
    tau = log.tau + trouble.hits * HIT_SIZE * log.tau.std(axis=0) * (rng.random((len(log), 1)) < HIT_SHARE)
    return replace(log, tau=tau, q=np.round(log.q / COARSE) * COARSE if trouble.coarse else log.q)


def measure(robot: str, trouble: Trouble, method: str, logs: int) -> tuple[float, float, float]:
    """Gives the mean parameter error [%], torque error [%] and CPU time [s]."""
    plant = plant_of(robot, trouble.sensors)
    base = find_base_parameters(plant.model)
    truth = base.from_standard(plant.parameters)
    unseen = fourier_motion(plant.robot, 1000)
    Y = base.regressor(unseen.q, unseen.dq, unseen.ddq)
    rms = np.sqrt(np.mean((Y @ truth) ** 2, axis=0))
    own = np.array([column.joint - 1 for column in base.columns])
    size = np.sqrt(np.mean(Y**2, axis=0))[own, np.arange(base.size)] / rms[own]
    found = []
    for seed in range(logs):
        log = spoilt(simulate(plant, fourier_motion(plant.robot, seed), seed=seed), trouble, seed)
        start = time.process_time()
        values = identify(plant.robot, log, method=method).model.values
        seconds = time.process_time() - start
        parameters = np.sqrt(np.mean(((values - truth) * size) ** 2))
        torque = np.mean(np.sqrt(np.mean((Y @ (values - truth)) ** 2, axis=0)) / rms)
        found.append((100 * parameters, 100 * torque, seconds))
    means = np.mean(found, axis=0)
    return float(means[0]), float(means[1]), float(means[2])


def program_alone(robot: str, pull: str) -> tuple[float, float]:
    """CPU time [s] of one semidefinite program, and of the whole choice of its pull."""
    plant = plant_of(robot, Sensors())
    base = find_base_parameters(plant.model)
    motion = fourier_motion(plant.robot, 0)
    tau = simulate(plant, motion).tau
    assert tau is not None
    rows = Rows(motion, tau, np.ones_like(tau))
    moments = Moments.of(base.regressor(motion.q, motion.dq, motion.ddq), tau, rows.mask)
    data = RegressionData(base=base, moments=moments, parts=[rows], ridge=1e-8)
    seconds = []
    for weight in (1e-3, None):
        member = PhysicallyConsistent(pull=pull, weight=weight)
        start = time.process_time()
        member.refine(data, *member.solve(moments, 1e-8))
        seconds.append(time.process_time() - start)
    return seconds[0], seconds[1]


def main() -> int:
    warnings.simplefilter("ignore", AssumedValueWarning)
    logs = int(sys.argv[1]) if len(sys.argv) > 1 else LOGS
    import clarabel
    import cvxpy

    print(f"cvxpy {cvxpy.__version__}, Clarabel {clarabel.__version__}")
    print("semidefinite program, CPU seconds:         one solve   with its pull chosen by 4 blocks x 4 weights")
    for robot in ROBOTS:
        for pull in ("entropic", "euclidean"):
            one, whole = program_alone(robot, pull)
            print(f"  {robot:6} {plant_of(robot, Sensors()).robot.n} joints, {pull:10} {one:24.3f} {whole:12.3f}")
    for robot in ROBOTS:
        print(f"{robot}, mean of {logs} logs: parameter error %, unseen torque error %; CPU s of the first trouble")
        print("  method      " + "".join(f"{trouble.name:>22}" for trouble in TROUBLES) + "      CPU s")
        for method in ESTIMATORS:
            cells, seconds = [], np.nan
            for trouble in TROUBLES:
                try:
                    parameters, torque, cpu = measure(robot, trouble, method, logs)
                except OedError as error:
                    cells.append(f"{type(error).__name__:>22}")
                    continue
                cells.append(f"{parameters:12.3f} {torque:9.3f}")
                seconds = cpu if np.isnan(seconds) else seconds
            print(f"  {method:12}{''.join(cells)} {seconds:10.2f}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
