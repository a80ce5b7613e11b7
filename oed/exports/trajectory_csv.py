"""The trajectory file: an ECSV block, then t, positions, velocities and accelerations at the controller's period."""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from robots.common.arrays import Array
from robots.common.errors import InputError, ShorterWayWarning
from robots.common.files import write_atomic
from robots.common.plain import joints_in_words
from robots.common.tables.table_files import Table, read_table, write_table
from robots.signals import Motion

QUANTITIES = ("q", "dq", "ddq")
RATES = {"q": "", "dq": "/s", "ddq": "/s2"}
LENGTHS = {"rad": 1.0, "deg": float(np.pi / 180.0), "m": 1.0, "mm": 1e-3}
JOINT_COLUMN = re.compile(r"(q|dq|ddq)([1-9]\d*)")


def write_trajectory(
    path: str | PathLike[str],
    motion: Motion,
    metadata: Mapping[str, Any] | None = None,
    *,
    kinds: Sequence[str] | None = None,
    degrees: bool = False,
    positions_only: bool = False,
    bare: bool = False,
    force: bool = False,
) -> None:
    """Writes a motion as t, q1..qn, dq1..dqn, ddq1..ddqn; numbers read back exactly.

    Args:
        path: the file, ending in .csv.
        motion: uniform in time.
        metadata: what else the block shall state, such as robot, criterion and tool version.
        kinds: "revolute" or "prismatic" of each joint; by default those under "kinds" in the metadata, as
            `read_trajectory` returns them, or all revolute. Prismatic joints are in m.
        degrees: angles in degrees; the block says so, and `read_trajectory` turns them back.
        positions_only: leave out velocities and accelerations.
        bare: no block, just the header line.
        force: overwrite an existing file.

    Raises:
        InputError: a motion with uneven steps, an existing file without force, or a path that cannot be written.
    """
    if motion.period is None:
        raise InputError(
            "the motion is not uniform in time", file=path, remedy="resample it at the controller's period"
        )
    stated = {"period": motion.period, **(metadata or {})}
    known = stated.pop("kinds", None)
    kinds = list(kinds or known or ["revolute"] * motion.n)
    if len(kinds) != motion.n:
        raise InputError(f"{len(kinds)} joint kinds", file=path, allowed=f"{motion.n}, one per joint")
    columns: dict[str, Array] = {"t": motion.t}
    units = {"t": "s"}
    for quantity in QUANTITIES[:1] if positions_only else QUANTITIES:
        for joint, kind in enumerate(kinds):
            values = getattr(motion, quantity)[:, joint]
            length = "m" if kind == "prismatic" else "deg" if degrees else "rad"
            columns[f"{quantity}{joint + 1}"] = np.rad2deg(values) if length == "deg" else values
            units[f"{quantity}{joint + 1}"] = f"{length}{RATES[quantity]}"
    if not bare:
        write_table(path, columns, stated, units=units, force=force)
        return
    rows = np.column_stack(list(columns.values())).tolist()
    lines = [",".join(columns), *(",".join(map(repr, row)) for row in rows)]
    write_atomic(path, "\n".join(lines) + "\n", force=force)


def read_trajectory(path: str | PathLike[str], *, n: int | None = None) -> tuple[Motion, dict[str, Any]]:
    """Reads a trajectory file and checks that it can be followed.

    Other columns than t, q, dq and ddq are ignored. Columns in degrees or millimetres become radians or metres.

    Args:
        path: the file.
        n: the number of joints it must have, if known.

    Returns:
        The motion in rad or m and s, and what the block states. Where it states units, "kinds" has "revolute" or
        "prismatic" of each joint.

    Raises:
        InputError: a missing column, an unknown unit, an empty cell or NaN, time that runs backward or unevenly, or
            velocities and accelerations that are not the derivatives of the positions; with column and line.

    Warns:
        ShorterWayWarning: angles that jump by whole turns while their velocities go on are taken as going round.
    """
    table = read_table(path, wanted=lambda name: name == "t" or JOINT_COLUMN.fullmatch(name) is not None)
    count = _count_joints(table, n)
    t = read_column(table, "t")
    q, dq, ddq = (
        np.column_stack([read_lengths(table, quantity, joint + 1) for joint in range(count)]) for quantity in QUANTITIES
    )
    _check_time(t, table)
    kinds = _kinds(table, count)
    q = _without_jumps(q, dq, t, kinds.get("kinds", ["revolute"] * count), table)
    motion = Motion(t, q, dq, ddq)
    _check_derivatives(motion, table)
    return motion, dict(table.metadata) | kinds


def _without_jumps(q: Array, dq: Array, t: Array, kinds: Sequence[str], table: Table) -> Array:
    """Angles without jumps by whole turns, where the velocities go on: planners keep angles within a turn."""
    gap = np.diff(q, axis=0) - np.diff(t)[:, None] * (dq[:-1] + dq[1:]) / 2.0
    turns = np.round(gap / (2 * np.pi)) * [kind == "revolute" for kind in kinds]
    if not turns.any():
        return q
    row, joint = (int(index) for index in np.argwhere(turns)[0])
    joints = joints_in_words(int(number) + 1 for number in np.flatnonzero(turns.any(axis=0)))
    text = (
        f"{table.path}: row {table.line(row + 1)}: the angle of joint {joint + 1} jumps by {360 * turns[row, joint]:g} "
        f"degrees while its velocity goes on; such jumps are taken out ({joints})"
    )
    warnings.warn(ShorterWayWarning(text), stacklevel=3)
    return np.concatenate([q[:1], q[1:] - 2 * np.pi * np.cumsum(turns, axis=0)])


def _kinds(table: Table, count: int) -> dict[str, list[str]]:
    """What the units say of the joints; nothing where one has none."""
    units = [table.units.get(f"q{joint + 1}") for joint in range(count)]
    return {} if None in units else {"kinds": ["prismatic" if unit in ("m", "mm") else "revolute" for unit in units]}


def _count_joints(table: Table, n: int | None) -> int:
    found = [int(match[2]) for match in map(JOINT_COLUMN.fullmatch, table.names) if match is not None]
    count = n or max(found, default=0)
    if count == 0:
        raise InputError("no joint columns", file=table.path, allowed="t,q1..qn,dq1..dqn,ddq1..ddqn")
    needed = ["t", *(f"{quantity}{joint}" for quantity in QUANTITIES for joint in range(1, count + 1))]
    missing = [name for name in needed if name not in table.columns]
    if missing:
        raise InputError(
            "the column is missing" + (f" (and {len(missing) - 1} more)" if len(missing) > 1 else ""),
            file=table.path,
            column=missing[0],
            allowed=f"t,q1..q{count},dq1..dq{count},ddq1..ddq{count}",
            remedy=(
                "use the trajectory.csv of oed design with columns t, q, dq and ddq; a positions-only export is for "
                "the controller"
            ),
        )
    if max(found) > count:
        raise InputError(f"columns for {max(found)} joints", file=table.path, allowed=f"{count} joints")
    return count


def read_column(table: Table, name: str) -> Array:
    """Reads numbers from a column.

    Raises:
        InputError: text or a number that is not finite, with its line.
    """
    values = table.columns[name]
    if table.is_text(name):
        raise InputError(f"found {values[0]!r}", file=table.path, column=name, row=table.line(0), allowed="numbers")
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        raise InputError(
            f"found {values[bad[0]]}",
            file=table.path,
            column=name,
            row=table.line(int(bad[0])),
            allowed="finite numbers in every row",
        )
    return values


def read_lengths(table: Table, quantity: str, joint: int) -> Array:
    """Reads positions [rad or m], velocities or accelerations of a joint, counted from 1.

    Raises:
        InputError: text, a number that is not finite, or an unknown unit.
    """
    name = f"{quantity}{joint}"
    values, unit = read_column(table, name), table.units.get(name)
    if unit is None:
        return values
    length, rate = re.sub(r"[\s*^]", "", unit), RATES[quantity]
    factor = LENGTHS.get(length.removesuffix(rate)) if length.endswith(rate) else None
    if factor is None:
        allowed = ", ".join(f"{known}{rate}" for known in LENGTHS)
        raise InputError(f"unit {unit!r}", file=table.path, column=name, allowed=allowed)
    return values if factor == 1.0 else np.deg2rad(values) if length.startswith("deg") else values * factor


def _check_time(t: Array, table: Table) -> None:
    if t.size < 2:
        raise InputError("the trajectory has only one sample", file=table.path, allowed="two rows or more")
    steps = np.diff(t)
    backward = np.flatnonzero(steps <= 0.0)
    if backward.size:
        row = int(backward[0]) + 1
        raise InputError(
            f"time does not advance: {t[row]:.9g} s after {t[row - 1]:.9g} s",
            file=table.path,
            column="t",
            row=table.line(row),
            allowed="increasing times",
        )
    period = (t[-1] - t[0]) / (t.size - 1)
    # A file may state its times in whole microseconds.
    uneven = np.flatnonzero(np.abs(steps - period) > 1e-6 + 1e-6 * period)
    if uneven.size:
        row = int(np.abs(steps - np.median(steps)).argmax()) + 1
        raise InputError(
            f"the time step is {steps[row - 1]:.9g} s, the others are {np.median(steps):.9g} s",
            file=table.path,
            column="t",
            row=table.line(row),
            allowed="a uniform period",
            remedy="sample it again at the controller's period",
        )


def _check_derivatives(motion: Motion, table: Table) -> None:
    """Compares each step with the trapezoidal rule, whose error the change of the next derivative bounds."""
    step = np.diff(motion.t)[:, None]
    change = np.abs(np.diff(motion.ddq, axis=0))
    # The acceleration may rise and fall within one step; the steps around it bound how fast.
    padded = np.pad(change, ((1, 1), (0, 0)), mode="edge")
    change = np.maximum(change, np.maximum(padded[:-2], padded[2:]))
    checks = (
        # Allowances: acceleration may jump within a step; then 0.1 % of the speed and six decimals in the file.
        ("dq", motion.q, motion.dq, step**2 * change + 1e-3 * step * np.abs(motion.dq).max(axis=0) + 1e-5),
        ("ddq", motion.dq, motion.ddq, step * change + 1e-2 * step * np.abs(motion.ddq).max(axis=0) + 1e-4),
    )
    for name, integral, rate, allowance in checks:
        error = np.abs(np.diff(integral, axis=0) - step * (rate[:-1] + rate[1:]) / 2.0)
        bad = np.argwhere(error > allowance)
        if bad.size:
            row, joint = (int(index) for index in bad[0])
            derived = (integral[row + 1, joint] - integral[row, joint]) / step[row, 0]
            raise InputError(
                (
                    f"{rate[row + 1, joint]:.4g} is not the derivative of {name[1:]}{joint + 1}, which changes by "
                    f"{derived:.4g} per second"
                ),
                file=table.path,
                column=f"{name}{joint + 1}",
                row=table.line(row + 1),
                allowed="the derivative, in rad or m, and s (degrees only if the comment block says so)",
            )


def is_trajectory(path: Path) -> bool:
    """Says whether a CSV has velocities and accelerations and nothing that was measured.

    Args:
        path: of the file.
    """
    if path.suffix.lower() != ".csv":
        return False
    with path.open(encoding="utf-8", errors="replace") as stream:
        header = next((line for line in stream if not line.startswith("#")), "")
    names = {word.strip().lower() for word in header.split(",")}
    return {"t", "q1", "dq1", "ddq1"} <= names and not names & {"tau1", "i1", "temp1"}
