"""How often the stated 95 % intervals hold the truth, over many simulated experiments.

Run it with ``python benchmarks/coverage.py [SEEDS [WORKERS]]``. Each case plays random Fourier motions on a virtual
robot whose parameters are 10 % off its description, identifies it from the log, and counts how many of the true base
parameters lie within 1.96 and within 3 standard errors. With honest standard errors that is 95 % and 99.7 %.

Of 200 draws a share of 95 % is known to 1.5 % only, and the worst of 70 parameters lies 3 % below it by chance.
The noise is ours, so that the fit's exact standard errors are known, too: Y'W Gamma W Y with the autocovariance that
the plant's noise has, sigma^2 (1 - s + s rho^k). Stated over exact errors show a parameter's true coverage to a
thousandth, and the share within 1.96 exact errors shows what is luck of the draws.
"""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter
from scipy.stats import norm

from estimation import Estimate, identify
from estimation.estimators import WeightedLeastSquares
from estimation.identifications.fit import sum_moments
from estimation.regressions.joint_regressor import JointRegressor
from estimation.regressions.preparation import prepare
from estimation.uncertainty.quantiles import NORMAL_95
from robots import load_robot, nominal_plant, simulate
from robots.base_parameters import find_base_parameters
from robots.common.errors import AssumedValueWarning
from robots.common.parallel import parallel_map
from robots.plants import Plant, Sensors
from robots.robot import Robot
from robots.signals import Log, Motion

Array = NDArray[np.float64]

SEEDS = 200
MOTIONS = 8
DURATION, PERIOD, HARMONICS, BASE_FREQUENCY = 30.0, 0.004, 5, 0.1
CLASSES = {"f1": "f1", "f2": "f2", "f3": "f3", "f4": "f4", "Im": "rotor", "offset": "offset"}


@dataclass(frozen=True)
class Case:
    """A robot, the memory of its torque noise [s], and the sharpness of its true sign [rad/s]."""

    robot: str
    correlation_time: float
    velocity_scale: float


def cases() -> Iterator[Case]:
    """Lists all cases."""
    for robot in ("er3a", "ur10"):
        for correlation_time in (0.04, 0.1):
            for velocity_scale in (1e-4, 1e-3):
                yield Case(robot, correlation_time, velocity_scale)


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


@lru_cache(maxsize=4)
def plant_of(case: Case) -> Plant:
    """Builds the virtual robot; a UR10, whose drives nobody describes, gets plausible ones."""
    robot = load_robot(case.robot)
    if not robot.friction.any():
        strength = np.array([12.0, 12.0, 8.0, 3.0, 3.0, 3.0])
        robot = replace(
            robot,
            friction=strength[:, None] * np.array([1.0, 0.8, 0.0, 0.0]),
            rotor_inertia=0.15 * strength,
            gear_ratio=np.full(robot.n, 100.0),
        )
    sensors = Sensors(correlation_time=case.correlation_time)
    return nominal_plant(robot, velocity_scale=case.velocity_scale, sensors=sensors, spread=0.1, seed=1)


@dataclass(frozen=True)
class Run:
    """One identification: errors over their standard errors (b,), chi^2 over b, and what counts as determined."""

    z: Array
    chi_square: float
    determined: NDArray[np.bool_]
    stated: Array
    exact: Array


def run(task: tuple[Case, int]) -> Run:
    """Simulates and identifies one log, and compares with the truth."""
    warnings.simplefilter("ignore", AssumedValueWarning)
    case, seed = task
    plant = plant_of(case)
    log = simulate(plant, fourier_motion(plant.robot, seed % MOTIONS), seed=seed)
    estimate = identify(plant.robot, log, friction="polynomial")
    model = estimate.model
    error = model.values - find_base_parameters(plant.model).from_standard(plant.parameters)
    scale = np.sqrt(np.diag(model.covariance))
    z = error / scale
    correlation = model.covariance / scale[:, None] / scale
    chi_square = float(z @ np.linalg.solve(correlation, z)) / len(z)
    return Run(z, chi_square, model.determined, scale, exact_errors(plant, log, estimate, seed % MOTIONS))


def exact_errors(plant: Plant, log: Log, estimate: Estimate, motion: int) -> Array:
    """Standard errors (b,) of that fit under the noise that the plant really has, and the prior's scatter."""
    sensors = plant.sensors
    quiet = replace(plant, sensors=replace(sensors, torque_noise=0.0))
    tau = simulate(quiet, fourier_motion(plant.robot, motion)).tau
    assert tau is not None
    level = sensors.torque_noise * np.sqrt(np.mean(tau**2, axis=0))
    rho, share = np.exp(-PERIOD / sensors.correlation_time), sensors.coloured_share
    regressor = JointRegressor(find_base_parameters(estimate.model.torque_model))
    rows = prepare(plant.robot, log).rows(estimate.choice.smoother)
    choice = estimate.choice
    moments = sum_moments(regressor, [rows]).pulled(choice.prior)
    _, weights = WeightedLeastSquares().solve(moments, choice.ridge)
    inverse = moments.inverse(weights, choice.ridge)
    held = choice.ridge * float(weights @ moments.square) * inverse
    meat = np.zeros_like(inverse)
    state = rows.motion.q, rows.motion.dq, rows.motion.ddq
    for joint, (Y, used) in enumerate(zip(regressor(*state), regressor.used, strict=True)):
        X = Y * (weights[joint] * rows.mask[:, joint, None])
        before, after = (lfilter([1.0], [1.0, -rho], part, axis=0) for part in (X, X[::-1]))
        coloured = before + after[::-1] - X  # sum_k rho^|k| X(t + k)
        meat[np.ix_(used, used)] += level[joint] ** 2 * X.T @ ((1 - share) * X + share * coloured)
    return np.asarray(np.sqrt(np.diag(inverse @ meat @ inverse + held @ choice.prior.precision @ held)))


def table(case: Case, seeds: range, workers: int | None = None) -> str:
    """Measures a case: a row per parameter class. All base parameters count, determined or not."""
    start = time.perf_counter()
    runs = parallel_map(run, [(case, seed) for seed in seeds], workers=workers)
    z = np.array([result.z for result in runs])
    determined = np.array([result.determined for result in runs])
    columns = find_base_parameters(plant_of(case).model).columns
    kinds = np.array([CLASSES.get(column.symbol, "inertial") for column in columns])
    inside, near = np.abs(z) <= NORMAL_95, np.abs(z) <= 3
    lines = [
        f"{case.robot}, noise of {case.correlation_time:g} s, true sign tanh(dq / {case.velocity_scale:g}): "
        f"{len(seeds)} logs, {time.perf_counter() - start:.0f} s",
        "  class     count  determined  within 95 %  within 3 SE  mean z^2  worst: bias in SE, within 95 %",
    ]
    for kind in (*dict.fromkeys(kinds), "all"):
        of = np.flatnonzero((kinds == kind) | (kind == "all"))
        worst = of[int(np.argmin(inside[:, of].mean(axis=0)))]
        shares = [100 * values[:, of].mean() for values in (determined, inside, near)]
        lines.append(
            f"  {kind:9} {len(of):5} {shares[0]:9.1f} % {shares[1]:10.1f} % {shares[2]:10.2f} % "
            f"{np.mean(z[:, of] ** 2):9.2f}  {columns[worst].name}: {z[:, worst].mean():+.2f}, "
            f"{100 * inside[:, worst].mean():.1f} %"
        )
    ratio = np.median([result.stated / result.exact for result in runs], axis=0)
    least, most = int(np.argmin(ratio)), int(np.argmax(ratio))
    coverage = 2 * norm.cdf(NORMAL_95 * ratio) - 1
    lucky = (np.abs(z * np.array([result.stated / result.exact for result in runs])) <= NORMAL_95).mean(axis=0)
    lines += [
        f"  stated over exact standard errors: {np.median(ratio):.3f} at the median parameter, {ratio[least]:.3f} "
        f"({columns[least].name}) to {ratio[most]:.3f} ({columns[most].name}); without luck 1.96 of them hold "
        f"{100 * coverage.min():.1f} to {100 * coverage.max():.1f} %",
        f"  of these draws {100 * lucky.mean():.1f} % lie within 1.96 exact errors, of the worst parameter "
        f"{100 * lucky.min():.1f} %",
    ]
    lines.append(f"  chi^2 of all together, over their number: {np.mean([result.chi_square for result in runs]):.2f}")
    return "\n".join(lines)


def main() -> int:
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else SEEDS
    workers = int(sys.argv[2]) if len(sys.argv) > 2 else None
    for number, case in enumerate(cases()):
        # Each case has noise of its own, so that the tables are independent.
        print(table(case, range(number * seeds, (number + 1) * seeds), workers), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
