"""Torque predicted cold and warm: a 2 h campaign of a virtual er3a whose friction falls as its joints warm up.

Run it with ``python benchmarks/thermal_campaign.py [cycles]``. A quick design becomes a campaign of 24 cycles of 5 min,
which a virtual er3a with the published thermal models plays at 4 ms. Rigid body, friction and heat are fitted to it;
another excitation, which no fit has seen, is then predicted on the cold robot and right after the campaign. The noise
floor is what the virtual robot's sensors added; errors are torque RMS over that. "Perfect" is the virtual robot itself
on the positions of the log instead of its motion: what it misses beyond the noise is lost in the log, at reversals of a
joint. All samples, and those in which the joint moves faster than 0.8 % of its RMS speed, as in the fit.
"""

from __future__ import annotations

import platform
import resource
import sys
import time
import warnings
from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

import oed
from estimation import identify
from estimation.models.model import Model
from estimation.preprocessing import resample, smooth
from estimation.regressions.preparation import SIGN_SPEED_SHARE
from estimation.thermal import fit_campaign, start_temperatures
from oed.campaigns import Programme, play
from robots.common.errors import AssumedValueWarning
from robots.loading import load_robot
from robots.plants import Sensors, nominal_plant, simulate
from robots.plants.heat import HeatPiece, heat_piece, plant_heat, reference_friction
from robots.signals import Log, Motion

T = TypeVar("T")
Array = NDArray[np.float64]
NOISE = 0.02


def timed(what: str, work: Callable[[], T]) -> T:
    wall, cpu = time.perf_counter(), time.process_time()
    result = work()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024  # kB on Linux
    seconds, own = time.perf_counter() - wall, time.process_time() - cpu
    print(f"{what:38s} {seconds:7.1f} s ({own:.1f} s CPU)   peak memory {peak:6.0f} MB", flush=True)
    return result


def main() -> int:
    warnings.simplefilter("ignore", AssumedValueWarning)
    cycles = int(sys.argv[1]) if len(sys.argv) > 1 else 24
    print(f"Python {platform.python_version()}, numpy {np.__version__}")
    robot = load_robot("er3a")
    plant = replace(
        nominal_plant(robot, spread=0.1, seed=3, sensors=Sensors(torque_noise=NOISE)),
        heat=plant_heat(robot, known=True),
    )
    assert plant.heat is not None
    design = timed("quick design", lambda: oed.design(robot, search=oed.SearchOptions(effort="quick", workers=1)))
    other = timed(
        "another one, for testing",
        lambda: oed.design(robot, search=oed.SearchOptions(effort="quick", workers=1, seed=5)),
    )
    campaign = timed("plan", lambda: oed.campaign(robot, design=design, programme=Programme(cycles=cycles)))
    logs = timed("played", lambda: list(play(campaign, plant, seed=1)))
    without = timed("fit without heat", lambda: identify(robot, logs).model)
    estimate = timed("fit with heat", lambda: fit_campaign(robot, logs, order="second", model=without))
    print(estimate.summary())

    true_before: list[HeatPiece] = []
    for log in logs:
        seen = seen_motion(log, without)
        true_before.append(heat_piece(seen, reference_friction(plant.model, plant.parameters, seen)))
    test, worst = other.motion, 0.0
    print("error of unseen torque over the noise floor, joint by joint")
    for name, shift in (("cold", 0.0), ("warm", float(logs[-1].t[-1]) + 1.0)):
        warm = name == "warm"
        motion = Motion(test.t - test.t[0] + shift, test.q, test.dq, test.ddq)
        own = heat_piece(motion, reference_friction(plant.model, plant.parameters, motion))
        warmth = plant.heat.follow([*(true_before if warm else []), own])
        log = simulate(plant, motion, seed=99, warmth=warmth)
        assert log.tau is not None
        noise = log.tau - plant.torque(motion, warmth)
        seen = seen_motion(log, without)
        starts = start_temperatures(estimate.torque_model, logs, float(motion.t[0])) if warm else None
        rows = {
            "with heat": estimate.torque_model.simulate(seen, start=starts)[0],
            "without": without.torque(seen.q, seen.dq, seen.ddq),
            "perfect": plant.torque(seen, warmth),
        }
        speed = np.sqrt(np.mean(seen.dq**2, axis=0))
        for rows_name, used in (
            ("all", np.ones(seen.q.shape, dtype=bool)),
            ("moving", np.abs(seen.dq) >= SIGN_SPEED_SHARE * speed),
        ):
            floor = rms(noise, used)
            for label, torque in rows.items():
                share = rms(log.tau - torque, used) / floor
                print(f"  {name}, {rows_name:6}, {label:10} " + " ".join(f"{value:7.3f}" for value in share))
                if label == "with heat" and rows_name == "moving":
                    worst = max(worst, float(share.max()))
    print(f"largest ratio with heat while moving: {worst:.3f} (1.2 allowed)")
    return int(worst > 1.2)


def seen_motion(log: Log, model: Model) -> Motion:
    return smooth(resample(log.t, log.q), float(model.provenance.get("cutoff_hz", 10.0)))


def rms(error: Array, used: NDArray[np.bool_]) -> Array:
    return np.sqrt(np.sum(np.where(used, error, 0.0) ** 2, axis=0) / used.sum(axis=0))


if __name__ == "__main__":
    sys.exit(main())
