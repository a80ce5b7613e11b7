"""Logs from files of any known format."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from estimation.logs.campaigns import MAPPING, in_order, log_files
from estimation.logs.clocks import advice_on_times
from estimation.logs.columns import BY_FIELD, QUANTITIES, Quantity, column_name, parse_name, refuse_text, unit_factors
from estimation.logs.formats import is_bag_folder
from estimation.logs.incomplete_rows import complete_rows
from estimation.logs.joint_numbers import NAMES, named_as_in_file
from estimation.logs.log_tables import read_log_table
from estimation.logs.mappings.mapped_tables import UNIT_NOTES
from estimation.logs.mappings.mapping import LogMapping, read_mapping, stated_rate
from estimation.logs.mappings.suggestions import PLAIN_REMEDY, remedy_for_columns
from estimation.logs.needed_columns import without_faulty_extras
from estimation.logs.repairs import repair_rows
from estimation.logs.torque_source import KEY, NO_TORQUE, parse_meaning
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.tables.table import Table
from robots.signals import Log

LISTED = 10
"""Columns of a file that an error message lists."""


def read_log(
    path: str | PathLike[str],
    n: int | None = None,
    *,
    torque: bool = True,
    mapping: LogMapping | str | PathLike[str] | None = None,
    joints: Sequence[str] | None = None,
    kinds: Sequence[str] | None = None,
) -> Log:
    """Reads a log: ``t, q1..qn``, torque or current, and whatever optional columns there are.

    Args:
        path: ``.csv`` (commas, semicolons, tabs or blanks; decimal points or commas; UTF-8; a leading ``#`` block may
            state units, robot and period), ``.parquet``, ``.mat``, ``.npz``, or a ROS bag with joint states (``.bag``,
            ``.mcap``, ``.db3``, or the folder of a rosbag 2). Recordings of UR RTDE, libfranka, KUKA FRI and
            ``rostopic echo -p`` are recognised by their columns.
        n: the number of joints of the robot, where it is known.
        torque: whether torque or current must be there; a prediction needs the motion only.
        mapping: a mapping YAML, where the columns have other names, units, signs or another order.
        joints: names of the robot's joints in its order: a bag names its joints, in any order.
        kinds: "revolute" or "prismatic" of each joint: units of angles do not apply to linear axes.

    Returns:
        The log in SI units. ``metadata`` holds what the file says of itself, ``file`` (its path),
        ``ignored_columns`` (the names of columns that are not read) and, where rows were repaired, ``repairs``.

    Raises:
        InputError: anything that keeps the file from being a log, with column and row: the line of a CSV file, the
            record of another file, both counted from 1.
    """
    known = mapping if isinstance(mapping, LogMapping) or mapping is None else read_mapping(mapping)
    table, notes = read_log_table(path, n, known, joints, kinds)
    with named_as_in_file(table.metadata.get(NAMES, {})):
        return _log(table, notes, n, torque, known, joints, kinds)


def _log(
    table: Table,
    notes: list[dict[str, Any]],
    n: int | None,
    torque: bool,
    mapping: LogMapping | None,
    joints: Sequence[str] | None,
    kinds: Sequence[str] | None,
) -> Log:
    """Makes a log of a table with its columns."""
    in_file = table.metadata.get(NAMES, {})
    names = (*(in_file.get(name, name) for name in table.names), *table.skipped)
    remedy = PLAIN_REMEDY if mapping else remedy_for_columns(names, n, joints)
    _checked_names(table, remedy)
    table, left_out = without_faulty_extras(table)
    quantities = _checked_names(table, remedy)
    count = _count_joints(table, quantities, n, remedy)
    for name in table.names:
        refuse_text(table, name)
    whole = table
    table, complete, gaps = complete_rows(table)
    table, kept, repairs = repair_rows(table)
    kept = complete[kept]
    repairs = [*notes, *left_out, *gaps, *repairs, *_not_read(table)]
    if len(table) < 2:
        raise InputError("only one row", file=table.path, row=table.first_row, allowed="2 or more rows")
    factors, unit_notes = unit_factors(table, quantities, kinds)
    repairs = [*table.metadata.get(UNIT_NOTES, ()), *unit_notes, *repairs]
    signals = {
        quantity.field: _signal(table, quantity, count, factors)
        for quantity in QUANTITIES
        if any(found is quantity for found in quantities.values())
    }
    if "tau" not in signals and "current" not in signals:
        lacking = f"neither tau1..tau{count} nor i1..i{count}" if count > 1 else "neither tau1 nor i1"
        remedy = table.metadata.get(NO_TORQUE, remedy)
        if torque:
            raise InputError(
                lacking,
                file=table.path,
                column="tau1",
                row=_header_row(table),
                allowed="columns of joint torque [N m] or motor current [A]",
                remedy=remedy,
            )
        if "command" not in signals:
            repairs.append(_without_torque(lacking, remedy))
    metadata = _metadata(table) | ({"repairs": repairs} if repairs else {})
    if mapping is not None and mapping.torque_is is not None:
        parse_meaning(mapping.torque_is, count)
        metadata[KEY] = mapping.torque_is
    try:
        return Log(**signals, name=table.path.stem, metadata=metadata)
    except InputError as error:
        _raise_for_file(error, whole, kept, signals)


def read_logs(
    paths: str | PathLike[str] | Sequence[str | PathLike[str]],
    n: int | None = None,
    *,
    torque: bool = True,
    mapping: LogMapping | str | PathLike[str] | None = None,
    joints: Sequence[str] | None = None,
    kinds: Sequence[str] | None = None,
) -> tuple[Log, ...]:
    """Reads the logs of one robot.

    Args:
        paths: files, each once, or folders: all logs of a folder are one campaign, in the order of its clock. A
            ``mapping.yaml`` in a folder is that of its logs.
        n: the number of joints of the robot; without it the first log decides.
        torque: see `read_log`.
        mapping: see `read_log`.
        joints: see `read_log`.
        kinds: see `read_log`.

    Raises:
        InputError: no file, a file twice, another number of joints, or a file that is not a log.
    """
    if isinstance(paths, str | PathLike):
        paths = [paths]
    if not paths:
        raise InputError("no logs", allowed="one or more files")
    seen: set[str] = set()
    logs: list[Log] = []

    def read(path: str | PathLike[str], mapping: LogMapping | str | PathLike[str] | None) -> Log:
        real = os.path.realpath(path)
        if real in seen:
            raise InputError(
                "the log is given twice",
                file=path,
                remedy="give each log once; otherwise it would count twice",
                kind="given_twice",
            )
        seen.add(real)
        log = read_log(path, n, torque=torque, mapping=mapping, joints=joints, kinds=kinds)
        if logs and log.n != logs[0].n:
            raise InputError(
                f"{log.n} joints, but {logs[0].metadata['file']} has {logs[0].n}",
                file=path,
                remedy="give logs of one robot",
            )
        return log

    for path in paths:
        place = Path(path)
        if place.is_dir() and not is_bag_folder(place):
            own = place / MAPPING
            chosen = _of_folder(own, mapping) if own.is_file() else mapping
            logs += in_order([read(file, chosen) for file in log_files(place)])
        else:
            logs.append(read(path, mapping))
    return tuple(logs)


def _of_folder(own: Path, mapping: LogMapping | str | PathLike[str] | None) -> LogMapping | str | PathLike[str] | None:
    """A given mapping counts before a folder's own; a rate alone is added to it."""
    if mapping is None:
        return own
    alone = isinstance(mapping, LogMapping) and mapping.rate is not None and mapping == LogMapping(rate=mapping.rate)
    return stated_rate(mapping.rate, own) if alone else mapping  # type: ignore[union-attr,arg-type]


def _checked_names(table: Table, remedy: str) -> dict[str, Quantity]:
    quantities: dict[str, Quantity] = {}
    for name in table.names:
        parsed = parse_name(name)
        assert parsed is not None
        quantity, joint = parsed
        if joint is not None and name != f"{quantity.prefix}{max(joint, 1)}":
            raise InputError(
                f"joint number {name.removeprefix(quantity.prefix)}",
                file=table.path,
                column=name,
                row=_header_row(table),
                allowed="joints counted from 1, without leading zeros",
                remedy="rename the columns",
            )
        quantities[name] = quantity
    if "t" not in quantities:
        raise InputError(
            f"the column is missing (found: {_listed(table)})",
            file=table.path,
            column="t",
            row=_header_row(table),
            allowed="t (seconds), q1.. and tau1.. or i1..",
            remedy=remedy,
            kind="missing_column",
        )
    return quantities


def _not_read(table: Table) -> list[dict[str, Any]]:
    """Names the columns that are no part of a log."""
    if not table.skipped:
        return []
    names = ", ".join(table.skipped[:LISTED]) + (", ..." if len(table.skipped) > LISTED else "")
    return [
        {
            "name": "columns_not_read",
            "text": f"not read: {names}",
            "action": "if a column belongs to the log, name it in a mapping (--mapping)",
            "value": len(table.skipped),
            "unit": "columns",
        }
    ]


def _listed(table: Table, prefix: str = "") -> str:
    """Lists columns of a file, unknown ones first, then those of a prefix."""
    names = [*table.skipped, *(name for name in table.names if name.startswith(prefix))]
    if not names:
        return "none"
    return ", ".join(names[:LISTED]) + (f", ... ({len(names)} columns)" if len(names) > LISTED else "")


def _count_joints(table: Table, quantities: Mapping[str, Quantity], n: int | None, remedy: str) -> int:
    """Returns the number of joints after checking that each quantity has its columns."""
    present: dict[str, set[int]] = {}
    for name, quantity in quantities.items():
        if quantity.per_joint:
            present.setdefault(quantity.prefix, set()).add(int(name.removeprefix(quantity.prefix)))
    # The highest number, so that q1, q2, q4 is a missing q3 and not three joints.
    joints = max(present.get("q", {0}))
    for quantity in QUANTITIES:
        found = present.get(quantity.prefix, set())
        if not quantity.per_joint or (not found and quantity.prefix != "q"):
            continue
        for joint in range(1, max(joints, 1) + 1):
            if joint not in found and quantity.complete:
                raise InputError(
                    f"the column is missing (found: {_listed(table, quantity.prefix)})",
                    file=table.path,
                    column=f"{quantity.prefix}{joint}",
                    row=_header_row(table),
                    allowed=f"one column for each of q1..q{joints}" if joints else "q1..qn",
                    remedy=PLAIN_REMEDY
                    + (f"; or remove all columns {quantity.prefix}1.." if found and quantity.prefix != "q" else "")
                    if joints
                    else remedy,
                    kind="missing_column",
                )
        extra = sorted(found - set(range(1, joints + 1)))
        if extra:
            raise InputError(
                f"there is no q{extra[0]}: the log has {joints} joints",
                file=table.path,
                column=f"{quantity.prefix}{extra[0]}",
                row=_header_row(table),
                remedy=f"add q{extra[0]} or remove the column",
            )
    if n is not None and joints != n:
        raise InputError(
            f"the log has {joints} joints (q1..q{joints}), the robot has {n}",
            file=table.path,
            column=f"q{min(joints, n) + 1}",
            row=_header_row(table),
            allowed=f"{n} joints",
            remedy="choose the robot of this log",
            kind="other_joints",
        )
    return joints


def _signal(table: Table, quantity: Quantity, joints: int, factors: Mapping[str, float]) -> Array:
    """Returns the array of one quantity in SI units, (N,) or (N, n); NaN for a joint that has no column."""
    if not quantity.per_joint:
        name = quantity.prefix
        values: Array = table.columns[name]
        return values if factors[name] == 1.0 else values * factors[name]
    signal = np.full((len(table), joints), np.nan)
    for joint in range(1, joints + 1):
        name = column_name(quantity, joint)
        if name in table.columns:
            # Damaged files hold values that are no numbers in a way that a product complains of: `Log` names them.
            with np.errstate(all="ignore"):
                np.multiply(table.columns[name], factors[name], out=signal[:, joint - 1])
    return signal


def _metadata(table: Table) -> dict[str, Any]:
    metadata = {
        key: value for key, value in table.metadata.items() if key not in ("units", NO_TORQUE, UNIT_NOTES, NAMES)
    }
    period = metadata.get("period")
    if period is not None:
        try:
            metadata["period"] = float(period)
        except (TypeError, ValueError):
            metadata["period"] = np.nan
        if isinstance(period, bool) or not 0.0 < metadata["period"] < np.inf:
            raise InputError(f"`period` is {period!r}", file=table.path, allowed="seconds, a positive number")
    robot = metadata.get("robot")
    if robot is not None and not isinstance(robot, str):
        raise InputError(f"`robot` is {robot!r}", file=table.path, allowed="a name")
    return {**metadata, "file": os.fspath(table.path), "ignored_columns": list(table.skipped)}


def _without_torque(lacking: str, remedy: str) -> dict[str, Any]:
    return {
        "name": NO_TORQUE,
        "text": f"{lacking}: without torque nothing can be identified",
        "action": remedy,
        "value": 0,
        "unit": "columns",
        "severity": "warning",
    }


def _header_row(table: Table) -> int | None:
    return table.first_row - 1 or None


def _raise_for_file(error: InputError, table: Table, kept: NDArray[np.intp], signals: Mapping[str, Array]) -> NoReturn:
    """Raises an error about an array as one about the file: its column by name, its row by line."""
    quantity = BY_FIELD[error.column or "t"]
    if error.problem.startswith("time"):
        remedy = advice_on_times(signals["t"], signals["q"])
    else:
        remedy = "repair or remove these rows, or leave out all columns of the quantity; an empty cell counts as nan"
    raise InputError(
        error.problem,
        file=table.path,
        column=column_name(quantity, error.joint if isinstance(error.joint, int) else None),
        row=None if error.row is None else table.line(int(kept[error.row - 1])),
        joint=error.joint,
        allowed=error.allowed,
        remedy=remedy,
    ) from error
