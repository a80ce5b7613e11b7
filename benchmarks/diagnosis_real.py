"""What the diagnosis says of logs of real robots without hints, and the gain on what it has not seen.

Run it with ``python benchmarks/diagnosis_real.py FOLDER``, where FOLDER holds the published logs as ``tests`` read
them. No figure here has a truth beside it but what the sources show of their machines.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

from estimation import diagnose, read_log  # noqa: E402
from estimation.logs.clocks import on_one_clock  # noqa: E402
from robots import load_robot  # noqa: E402
from robots.common.errors import AssumedValueWarning, OedError  # noqa: E402
from robots.robot import Robot  # noqa: E402
from robots.signals import Log  # noqa: E402
from tests.kr300 import kr300  # noqa: E402


@dataclass(frozen=True)
class Given:
    """What a diagnosis is given: without unseen logs, stretches or runs are kept apart."""

    robot: Robot
    logs: list[Log]
    unseen: list[Log] | None = None


def lwr4(folder: Path, _: Path) -> Given:
    """A trajectory of a KUKA LWR4+, and the same half an hour later (FloBaRoID)."""
    at = folder / "kuka_lwr4_flobaroid"
    first, second = (read_log(at / f"run{run}.parquet") for run in (1, 2))
    return Given(load_robot(at / "kuka_lwr4.urdf"), [first], [second])


def heavy_arm(folder: Path, out: Path) -> Given:
    """Ten seconds of a KUKA KR300 with encoders behind three gears (Weigand, 2021)."""
    robot, log = kr300(folder / "kuka_kr300_weigand", out / "kr300.yaml")
    return Given(robot, [log])


def single_pendulum(folder: Path, _: Path) -> Given:
    """Four runs of a pendulum, one moved by hand and one that rings (DFKI)."""
    at = folder / "simple_pendulum_dfki"
    runs = [read_log(path) for path in sorted(at.glob("*.parquet"))]
    return Given(load_robot(at / "simple_pendulum.urdf", unlimited=True), on_one_clock(runs))


def double_pendulum(folder: Path, _: Path) -> Given:
    """Nine runs of a double pendulum (DFKI)."""
    at = folder / "double_pendulum_dfki"
    runs = [read_log(path) for path in sorted(at.glob("A0pm_*.parquet"))]
    return Given(load_robot(at / "dp_design_A.0_model_2.1_pendubot.urdf"), on_one_clock(runs))


def ur10(folder: Path, _: Path) -> Given:
    """One trajectory of a UR10 whose log its authors filtered (Petrone and others, 2025)."""
    return Given(load_robot("ur10"), [read_log(folder / "ur10_unisa" / "exciting.parquet")])


def panda(folder: Path, _: Path) -> Given:
    """Ten seconds of a Panda with torque sensors and an uneven clock (Gaz and others, 2019)."""
    return Given(load_robot("panda"), [read_log(folder / "panda_gaz2019" / "traj1_first10s.parquet")])


def tiago(folder: Path, _: Path) -> Given:
    """A badly excited log of a TIAGo's torso and arm (FIGAROH)."""
    at = folder / "tiago_figaroh"
    joints = ["torso_lift_joint", *(f"arm_{number}_joint" for number in range(1, 8))]
    return Given(load_robot(at / "tiago_48_schunk.urdf", joints=joints), [read_log(at / "run1.parquet")])


SETS: dict[str, Callable[[Path, Path], Given]] = {
    function.__name__: function for function in (lwr4, heavy_arm, single_pendulum, double_pendulum, ur10, panda, tiago)
}


def say(name: str, folder: Path) -> None:
    """Diagnoses one set and prints what is said of it."""
    with tempfile.TemporaryDirectory() as out:
        print(f"\n{name}: {(SETS[name].__doc__ or '').splitlines()[0]}", flush=True)
        start = time.perf_counter()
        try:
            given = SETS[name](folder, Path(out))
            found = diagnose(given.robot, given.logs, held_out=given.unseen)
        except OedError as error:
            print(error)
            return
        print(found.summary())
        print(f"error over torque RMS on {found.how_unseen}:")
        for joint, (before, after) in enumerate(zip(found.baseline, found.extended, strict=True), start=1):
            print(f"  joint {joint}: {100 * before:.1f} -> {100 * after:.1f} %")
        print(f"{time.perf_counter() - start:.0f} s")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path, help="of the published logs, a folder a set")
    parser.add_argument("--sets", nargs="+", default=list(SETS), choices=list(SETS))
    options = parser.parse_args()
    warnings.simplefilter("ignore", AssumedValueWarning)
    if not options.folder.is_dir():
        parser.error(f"no folder {options.folder}")
    for name in options.sets:
        say(name, options.folder)
    return 0


if __name__ == "__main__":
    sys.exit(main())
