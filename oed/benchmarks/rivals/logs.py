"""Logs of a case as arrays."""

from __future__ import annotations

from pathlib import Path

from oed.benchmarks.folders import read_columns
from robots.common.arrays import Array


def read_motion(file: Path, joints: int, *, torque: bool) -> tuple[Array, Array, Array]:
    """Reads t (N,) [s], q (N, n) [rad] and tau (N, n) [N m]; tau has no rows where it is not asked for.

    Args:
        file: a log or an unseen motion.
        joints: number of joints.
        torque: whether the file has torque.

    Raises:
        InputError: a file that is missing or has no such columns.
    """
    names = ["t", *(f"q{j + 1}" for j in range(joints)), *(f"tau{j + 1}" for j in range(joints) if torque)]
    values = read_columns(file, names)
    return values[:, 0], values[:, 1 : 1 + joints], values[:, 1 + joints :]
