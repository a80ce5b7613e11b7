"""Files to try a calibration on: measured poses of a virtual robot whose geometry is not quite as described."""

from __future__ import annotations

import warnings
from importlib.resources import files
from os import PathLike
from pathlib import Path

import numpy as np

from robots.common.errors import AssumedValueWarning
from robots.common.files import ResultFolder, write_atomic

ROBOT = "er3a"
FILES = ("robot.yaml", "poses.csv", "held_out.csv")
ERRORS = {
    **{"zero_2": 0.0042, "zero_3": -0.0031, "zero_5": 0.0058},
    **{"link_2_y": 0.0007, "link_3_x": -0.0009, "link_3_rx": 0.0008, "link_4_z": 0.0006},
    **{"sine_3": 0.0009, "cosine_3": -0.0004, "joint_compliance_2": 4e-5},
}
"""What the description does not say of the robot: zeros, links, an encoder off its axis, a joint that gives way."""


def write_calibration_example(folder: str | PathLike[str], *, force: bool = False) -> tuple[Path, ...]:
    """Writes the robot's description, and poses that a tracker of 0.05 mm measured of three markers.

    Args:
        folder: made if need be.
        force: whether existing files of these names may be replaced.

    Returns:
        The files.

    Raises:
        InputError: one of the files exists, or the folder cannot be written to.
    """
    from estimation.calibrations.pose_tables import poses_to_columns
    from robots.common.tables.table_files import write_table
    from robots.geometry_errors import Markers, random_positions, simulate_poses
    from robots.loading import load_robot

    with warnings.catch_warnings():
        # Assumed masses and limits are of no concern for files to try a command on.
        warnings.simplefilter("ignore", AssumedValueWarning)
        robot = load_robot(ROBOT)
    measurement = Markers(count=3)
    setup = dict(measurement.example)
    # The tracker stands two metres in front of the robot and looks back.
    tracker = np.array([[-1.0, 0.0, 0.0, 2.0], [0.0, -1.0, 0.0, 0.1], [0.0, 0.0, 1.0, -0.5], [0.0, 0.0, 0.0, 1.0]])
    setup["tracker"] = type(setup["tracker"])(kind="pose", value=tracker)
    with ResultFolder(folder, force, names=FILES) as out:
        write_atomic(out.path("robot.yaml"), (files("robots.catalog") / f"{ROBOT}.yaml").read_bytes())
        for name, count, seed in (("poses.csv", 40, 1), ("held_out.csv", 20, 2)):
            q = random_positions(robot, count, seed=seed)
            poses = simulate_poses(robot, q, measurement, ERRORS, setup=setup, noise={"m": 5e-5}, seed=seed)
            write_table(out.path(name), poses_to_columns(poses), {"robot": ROBOT})
    return tuple(Path(folder) / name for name in FILES)


def next_calibration_commands(folder: str | PathLike[str]) -> tuple[str, str]:
    """Gives the command lines that use the files.

    Args:
        folder: with the files.
    """
    place = Path(folder)
    robot, calibrated = place / "robot.yaml", place / "calibrated"
    return (
        f"oed calibrate --robot {robot} --poses {place / 'poses.csv'} --held-out {place / 'held_out.csv'} "
        f"--out {calibrated}",
        f"oed design --robot {calibrated / 'robot.yaml'} --for calibration --poses 30 --out {place / 'next_poses'}",
    )
