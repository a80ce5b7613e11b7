"""Whether `oed compare` finds what changed and nothing else, on a plant that shares no code with it.

Run it with ``python benchmarks/comparison.py [PAIRS [CYCLES]]``. Robots, motions and coloured noise come from
``oed/benchmarks/truth``. Three studies:

1. Pairs of logs of one unchanged virtual er3a, of the same motion and of two motions: how often the 95 % intervals of
   the differences hold zero, how p-values are distributed, and in how many pairs anything is called significant at a
   family-wise rate of 1 %.
2. The same pairs with 10 % more friction on one joint from the second log on: how often that joint is named alone.
3. A robot that warms up until its friction has fallen by some 40 %, as in the thesis: by how much the inertial
   parameters of single cycles differ between cold and warm, without a thermal model and with one.
"""

from __future__ import annotations

import sys
import tempfile
import time
import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.stats import kstest

sys.path.insert(0, str(Path(__file__).parents[1]))

from estimation import compare, identify
from estimation.comparisons import ModelComparison, identify_runs
from estimation.preprocessing import resample, smooth
from estimation.thermal import fit_campaign, start_temperatures
from estimation.uncertainty.quantiles import NORMAL_95
from oed.benchmarks.truth.description import write_description
from oed.benchmarks.truth.effects.base import Effect
from oed.benchmarks.truth.effects.friction import FrictionStep, Warming
from oed.benchmarks.truth.machines import Machine, draw_machine
from oed.benchmarks.truth.noise import draw_noise
from oed.benchmarks.truth.plant import LOG_PAUSE, Record, play
from oed.benchmarks.truth.references import draw_periodic
from robots import load_robot
from robots.robot import Robot
from robots.signals import Log

Array = NDArray[np.float64]

PAIRS, CYCLES = 40, 16
PERIOD, REPEATS = 10.0, 3
DAMAGE = 0.10
# Time constants [s] of the warming robot, its cycle [s] and the rest between cycles [s].
FAST, SLOW, COOL = 150.0, 900.0, 5.0
# Fall of the friction per unit of heat: steady state is 2.5 units without pauses.
FALL = 0.38
# Percentages are given for parameters with at most this relative standard error.
PRECISE = 0.02


def described(machine: Machine) -> Robot:
    """Loads the description that a user has of a machine."""
    with tempfile.TemporaryDirectory() as folder:
        return load_robot(str(write_description(machine, Path(folder))))


def log_of(record: Record, number: int) -> Log:
    """Gives what a user has of a record."""
    return Log(record.t, record.q, record.tau, name=f"cycle {number}")


def pair(seed: int, same_motion: bool, damaged: int | None) -> ModelComparison:
    """Compares two logs of one machine; from the second log on, one joint has more friction where asked."""
    rng = np.random.default_rng([seed, int(same_motion)])
    machine = draw_machine("er3a", rng)
    noise = draw_noise(machine.n, machine.gear, rng)
    one = draw_periodic(machine, rng, period=PERIOD, cycles=REPEATS)
    two = one if same_motion else draw_periodic(machine, rng, period=PERIOD, cycles=REPEATS)
    effects: list[Effect] = []
    if damaged is not None:
        effects = [FrictionStep(joint=damaged, amount=DAMAGE, moment=one.duration + LOG_PAUSE / 2)]
    records = play(machine, [one, two], effects, noise, rng)
    logs = [log_of(record, k) for k, record in enumerate(records, start=1)]
    return compare(identify_runs(described(machine), logs))


def unchanged(pairs: int) -> None:
    """Prints coverage, p-values and false alarms of unchanged robots."""
    for same in (True, False):
        start = time.perf_counter()
        z, parts, whole, alarms, own = [], [], [], 0, 0
        for seed in range(pairs):
            found = pair(seed, same, None)
            z += [item.change / item.error for item in found.of_run(1, "parameter")]
            parts += [item.p_value for item in found.of_run(1, "part")]
            whole += [item.p_value for item in found.of_run(1, "whole")]
            alarms += bool(found.significant)
            own += bool(found.damaged)
        inside = np.mean(np.abs(z) <= NORMAL_95)
        print(
            f"unchanged robot, {'the same motion' if same else 'two motions'}: {pairs} pairs, {len(z)} parameters, "
            f"{time.perf_counter() - start:.0f} s\n"
            f"  95 % intervals of differences hold zero: {100 * inside:.1f} %; mean z^2 {np.mean(np.square(z)):.3f}\n"
            f"  p-values of parts below 5 %: {100 * np.mean(np.array(parts) < 0.05):.1f} %, below 1 %: "
            f"{100 * np.mean(np.array(parts) < 0.01):.2f} %; Kolmogorov-Smirnov p of the whole models against uniform "
            f"{kstest(whole, 'uniform').pvalue:.2g}, median p {np.median(whole):.2f}\n"
            f"  pairs with any false alarm at 1 %: {alarms} of {pairs}; with a joint called damaged: {own}",
            flush=True,
        )


def damaged(pairs: int) -> None:
    """Prints how often 10 % more friction on one joint is named."""
    named, others, sizes = 0, 0, []
    for seed in range(pairs):
        joint = seed % 6 + 1
        found = pair(seed, True, joint)
        joints = {item.joint for item in found.damaged}
        named += joint in joints
        others += bool(joints - {joint})
        sizes += [100 * np.expm1(item.own) for item in found.friction if item.joint == joint]
    print(
        f"{100 * DAMAGE:.0f} % more friction on one joint: named in {named} of {pairs} pairs; another joint named in "
        f"{others}; own change {np.mean(sizes):.1f} % on average ({np.min(sizes):.1f} to {np.max(sizes):.1f} %)",
        flush=True,
    )


def warming(cycles: int, seed: int = 3) -> None:
    """Prints how far inertial parameters move from cold to warm."""
    rng = np.random.default_rng(seed)
    machine = draw_machine("er3a", rng)
    noise = draw_noise(machine.n, machine.gear, rng)
    reference = draw_periodic(machine, rng, period=PERIOD, cycles=REPEATS)
    effects = [Warming(joint=j + 1, amount=FALL, fast=FAST, slow=SLOW, coulomb=1.0) for j in range(machine.n)]
    records = play(machine, [reference] * cycles, effects, noise, rng, pause=COOL)
    logs = [log_of(record, k) for k, record in enumerate(records, start=1)]
    robot = described(machine)
    plain = compare(identify_runs(robot, logs, friction="polynomial"))
    report("without a thermal model", plain)
    start = time.perf_counter()
    base = identify(robot, logs, friction="polynomial").model
    thermal = fit_campaign(robot, logs, order="second", model=base).torque_model
    corrected = [
        replace(log, tau=log.tau - heat)
        for log, heat in zip(logs, heat_torques(thermal, logs), strict=True)
        if log.tau is not None
    ]
    print(f"  thermal model fitted and applied in {time.perf_counter() - start:.0f} s")
    report("with a thermal model", compare(identify_runs(robot, corrected, friction="polynomial")))


def heat_torques(thermal, logs: Sequence[Log]) -> list[Array]:  # type: ignore[no-untyped-def]
    """Torque (N, n) of each log that heat adds to the friction of the cold robot [N m]."""
    found, cutoff = [], float(thermal.model.provenance.get("cutoff_hz", 10.0))
    for number, log in enumerate(logs):
        motion = smooth(resample(log.t, log.q), cutoff)
        begin = start_temperatures(thermal, logs[:number], float(motion.t[0])) if number else None
        warm, _ = thermal.simulate(motion, start=begin)
        cold = thermal.model.torque(motion.q, motion.dq, motion.ddq)
        found.append(np.column_stack([np.interp(log.t, motion.t, column) for column in (warm - cold).T]))
    return found


def report(title: str, found: ModelComparison) -> None:
    """Prints the differences of inertial parameters between the first and the last run."""
    last = len(found.runs) - 1
    common = found.common
    rigid = [i for i, c in enumerate(common.columns) if c.term == "rigid_body" and common.determined[i]]
    change = common.values[last, rigid] - common.values[0, rigid]
    variance = common.covariances[:, rigid, rigid]
    z = change / np.sqrt(variance[0] + variance[last])
    own = change / np.sqrt(np.maximum(variance[0], variance[last]))
    relative = np.abs(change / common.values[0, rigid])
    precise = np.sqrt(variance[0]) < PRECISE * np.abs(common.values[0, rigid])
    friction = [100 * (curve.level[last] / curve.level[0] - 1) for curve in found.curves]
    print(
        f"{title}: {len(found.runs)} cycles, friction at 60 % speed {min(friction):+.0f} to {max(friction):+.0f} %\n"
        f"  {len(rigid)} inertial parameters, cold against warm: of the {int(precise.sum())} with a standard error "
        f"below {100 * PRECISE:.0f} % the median differs by {100 * np.median(relative[precise]):.2f} %, the worst by "
        f"{100 * relative[precise].max():.2f} %\n"
        f"  over the standard error of the difference: RMS {np.sqrt(np.mean(z**2)):.2f}, worst {np.abs(z).max():.2f}; "
        f"over the larger standard error of both: within one {100 * np.mean(np.abs(own) < 1):.0f} %; significant "
        f"{sum(i.adjusted < found.alpha for i in found.of_run(last, 'parameter') if i.name in names(found, rigid))}\n"
        f"  RMS of the change that is systematic (z^2 - 1, over standard errors): "
        f"{np.sqrt(max(np.mean(z**2) - 1, 0.0)):.2f}",
        flush=True,
    )
    for item in found.friction:
        if item.run == last:
            print(f"    {item.sentence()}")
    settled = [d.settled for d in found.drifts if d.name.startswith("friction")]
    print(f"  friction settled from cycle {[None if s is None else s + 1 for s in settled]}", flush=True)


def names(found: ModelComparison, indices: Sequence[int]) -> set[str]:
    """Names of some parameters."""
    return {found.common.columns[i].name for i in indices}


def main() -> int:
    warnings.simplefilter("ignore")
    pairs = int(sys.argv[1]) if len(sys.argv) > 1 else PAIRS
    cycles = int(sys.argv[2]) if len(sys.argv) > 2 else CYCLES
    warming(cycles)
    unchanged(pairs)
    damaged(pairs)
    return 0


if __name__ == "__main__":
    sys.exit(main())
