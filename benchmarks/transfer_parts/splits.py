"""Splits of measured logs in which the test is an extrapolation: faster, elsewhere, or another motion."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from estimation import read_log
from robots import load_robot
from robots.common.stretches import spans
from robots.robot import Robot
from robots.signals import Log
from tests.kr300 import kr300

Array = NDArray[np.float64]

# Logs are cut into so many pieces of equal length, which are then ranked by speed or place.
PIECES = 12


@dataclass(frozen=True)
class Split:
    """What is fitted, and what is predicted.

    Attributes:
        name: set and kind of split.
        robot: the robot.
        fit: logs to fit to.
        test: log to predict.
        rows: rows (N,) of it that count.
    """

    name: str
    robot: Robot
    fit: tuple[Log, ...]
    test: Log
    rows: NDArray[np.bool_]


def within(name: str, robot: Robot, log: Log) -> Iterator[Split]:
    """Splits one log: slow pieces predict fast ones, and one half of the range of each wide joint the other half."""
    pieces = np.minimum(PIECES * (log.t - log.t[0]) / log.duration, PIECES - 1).astype(int)
    speed = np.abs(np.gradient(log.q, log.t, axis=0))
    usual = np.maximum(np.sqrt((speed**2).mean(axis=0)), 1e-9)
    fastness = np.array([(speed[pieces == k] / usual).mean() for k in range(PIECES)])
    yield _by_pieces(f"{name}, slow to fast", robot, log, pieces, fastness)
    widest = int(np.argmax(np.ptp(log.q, axis=0)))
    place = np.array([log.q[pieces == k, widest].mean() for k in range(PIECES)])
    yield _by_pieces(f"{name}, low to high joint {widest + 1}", robot, log, pieces, place)
    half = len(log) // 2
    yield Split(f"{name}, first to second half", robot, (log.rows(slice(0, half)),), log, np.arange(len(log)) >= half)


def _by_pieces(name: str, robot: Robot, log: Log, pieces: NDArray[np.intp], key: Array) -> Split:
    fitted = key[pieces] <= np.median(key)
    logs = tuple(log.rows(slice(start, stop)) for start, stop in spans(fitted) if stop - start > 10)
    return Split(name, robot, logs, log, ~fitted)


def _whole(name: str, robot: Robot, fit: Sequence[Log], test: Log) -> Split:
    return Split(name, robot, tuple(fit), test, np.ones(len(test), dtype=bool))


def lwr4(folder: Path) -> Iterator[Split]:
    """KUKA LWR4+: splits of a run, and a run from another."""
    at = folder / "kuka_lwr4_flobaroid"
    robot = load_robot(at / "kuka_lwr4.urdf")
    first, second = (read_log(at / f"run{run}.parquet") for run in (1, 2))
    yield from within("lwr4", robot, first)
    yield _whole("lwr4, run 1 to run 2", robot, [first], second)


def heavy_arm(folder: Path) -> Iterator[Split]:
    """KUKA KR300."""
    with tempfile.TemporaryDirectory() as out:
        robot, log = kr300(folder / "kuka_kr300_weigand", Path(out) / "kr300.yaml")
        yield from within("kr300", robot, log)


def ur10(folder: Path) -> Iterator[Split]:
    """UR10."""
    log = read_log(folder / "ur10_unisa" / "exciting.parquet")
    yield from within("ur10", load_robot("ur10"), log)


def panda(folder: Path) -> Iterator[Split]:
    """Franka Panda."""
    log = read_log(folder / "panda_gaz2019" / "traj1_first10s.parquet")
    yield from within("panda", load_robot("panda"), log)


def tiago(folder: Path) -> Iterator[Split]:
    """TIAGo: torso and arm."""
    at = folder / "tiago_figaroh"
    joints = ["torso_lift_joint", *(f"arm_{number}_joint" for number in range(1, 8))]
    yield from within("tiago", load_robot(at / "tiago_48_schunk.urdf", joints=joints), read_log(at / "run1.parquet"))


def double_pendulum(folder: Path) -> Iterator[Split]:
    """Double pendulum: each kind of run predicts the other."""
    at = folder / "double_pendulum_dfki"
    robot = load_robot(at / "dp_design_A.0_model_2.1_pendubot.urdf")
    swings, tracks = (sorted(at.glob(pattern)) for pattern in ("A0pm_*.parquet", "A0_*.parquet"))
    yield _whole("double pendulum, swings to a track", robot, [read_log(path) for path in swings], read_log(tracks[0]))
    yield _whole("double pendulum, tracks to a swing", robot, [read_log(path) for path in tracks], read_log(swings[0]))


def single_pendulum(folder: Path) -> Iterator[Split]:
    """Single pendulum: the run for identification predicts the others."""
    at = folder / "simple_pendulum_dfki"
    robot = load_robot(at / "simple_pendulum.urdf", unlimited=True)
    for name in ("ddp", "dircol"):
        yield _whole(
            f"pendulum, sysid to {name}", robot, [read_log(at / "sysid.parquet")], read_log(at / f"{name}.parquet")
        )


SETS: dict[str, Callable[[Path], Iterator[Split]]] = {
    f.__name__: f for f in (lwr4, heavy_arm, ur10, panda, tiago, double_pendulum, single_pendulum)
}
