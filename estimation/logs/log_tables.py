"""A log's table: its format recognised, its columns renamed, its times in seconds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from os import PathLike
from typing import Any

import numpy as np

from estimation.logs.columns import parse_name
from estimation.logs.formats import column_names, read_foreign
from estimation.logs.mappings.mapped_tables import count_joints, map_table
from estimation.logs.mappings.mapping import LogMapping
from estimation.logs.recorders import Recorder, recorder_of
from estimation.logs.torque_source import TorqueSource
from robots.common.errors import InputError
from robots.common.plain import several
from robots.common.tables.table import Table
from robots.common.tables.times import is_time, seconds_of


def read_log_table(
    path: str | PathLike[str],
    n: int | None,
    mapping: LogMapping | None,
    joints: Sequence[str] | None,
    kinds: Sequence[str] | None = None,
) -> tuple[Table, list[dict[str, Any]]]:
    """Reads a file as a table with the columns of a log.

    A recording of a known program needs no mapping. A mapping without positions changes what the program's recorder
    says, such as ``torque_constant`` for currents.

    Args:
        path: the file, or the folder of a rosbag 2.
        n: the number of joints, where it is known.
        mapping: what the columns mean.
        joints: names of the robot's joints in its order.
        kinds: "revolute" or "prismatic" of each joint, if known.

    Returns:
        The table, and notes of what was recognised.

    Raises:
        InputError: a file that cannot be read, or a column that a mapping or a recorder lacks.
    """
    if mapping is None or mapping.position is None:
        names = column_names(path)
        recorder = None if names is None else recorder_of(names)
        if recorder is not None:
            return _recognised(path, recorder, mapping, joints, kinds)
    if mapping is None:
        table = with_seconds(read_foreign(path, lambda name: parse_name(name) is not None, joints=joints), "t")
        return _noted(table)
    named = mapping.joints if mapping.joints is not None else joints
    # Which columns the mapping names depends on the number of joints, and that on the columns: names come first.
    table = read_foreign(path, lambda name: True, topic=mapping.topic, joints=named)
    return _noted(_mapped(table, mapping, count_joints(mapping, table.names, n), kinds))


def _recognised(
    path: str | PathLike[str],
    recorder: Recorder,
    mapping: LogMapping | None,
    joints: Sequence[str] | None,
    kinds: Sequence[str] | None,
) -> tuple[Table, list[dict[str, Any]]]:
    wanted = recorder.wanted.fullmatch
    table = read_foreign(path, lambda name: mapping is not None or wanted(name) is not None)
    known = recorder.understood(table, joints)
    stated = {} if mapping is None else {name: getattr(mapping, name) for name in mapping.model_fields_set}
    source = None if "torque" in stated or "current" in stated else known.source
    if "torque" in stated:
        stated.setdefault("current", None)
    elif "current" in stated:
        stated.setdefault("torque", None)
    merged = known.mapping.model_copy(update=stated)
    if merged.torque is None and merged.current is None and known.source is None:
        table = replace(table, metadata={**table.metadata, "no_torque": f"{recorder.name}: {known.remedy}"})
    if source is not None:
        table = replace(table, metadata={**table.metadata, "torque_source": source.to_dict()})
    return _noted(_mapped(table, merged, known.joints, kinds))


def _mapped(table: Table, mapping: LogMapping, joints: int, kinds: Sequence[str] | None) -> Table:
    if mapping.time is not None and mapping.time.column in table.columns:
        name, unit = mapping.time.column, mapping.time.unit
        if table.is_text(name) and unit not in (None, "s"):
            raise InputError(
                f"found {str(table.columns[name][0])[:40]!r}, and the mapping states the unit {unit!r}",
                file=table.path,
                column=name,
                row=table.first_row,
                allowed="numbers with a unit, or times such as 2024-05-03T12:34:56.789 without one",
            )
        table = with_seconds(table, name)
    mapped = map_table(with_seconds(table, "t"), mapping, joints, kinds)
    kept = {name: values for name, values in mapped.columns.items() if parse_name(name) is not None}
    left = tuple(name for name in mapped.columns if name not in kept)
    return replace(mapped, columns=kept, skipped=(*mapped.skipped, *left))


def with_seconds(table: Table, name: str) -> Table:
    """Converts a column of dates and times to seconds; other columns stay as they are.

    Args:
        table: as it was read.
        name: of the column; it may be missing.
    """
    if name not in table.columns or not table.is_text(name) or not is_time(table.columns[name][0]):
        return table
    return replace(table, columns={**table.columns, name: seconds_of(table, name)})


def _noted(table: Table) -> tuple[Table, list[dict[str, Any]]]:
    source = table.metadata.get("torque_source")
    # A file may state anything under this key.
    if not isinstance(source, dict) or set(source) != set(TorqueSource.__dataclass_fields__):
        return table, []
    return table, [TorqueSource(**source).note(len(table))]


def without_broken_derivatives(table: Table) -> tuple[Table, list[dict[str, Any]]]:
    """Drops velocities and accelerations that have gaps, as numerical differences do at their ends.

    They are computed from the positions anyway.

    Args:
        table: with the columns of a log.

    Returns:
        The table, and notes of what was dropped.
    """
    notes: list[dict[str, Any]] = []
    dropped: set[str] = set()
    for prefix, what in (("dq", "velocity"), ("ddq", "acceleration")):
        names = [name for name in table.names if _is_of(name, prefix) and not table.is_text(name)]
        gaps = {name: np.flatnonzero(~np.isfinite(table.columns[name])) for name in names}
        broken = {name: rows for name, rows in gaps.items() if len(rows)}
        if not broken:
            continue
        name, rows = next(iter(broken.items()))
        dropped.update(names)
        notes.append(
            {
                "name": f"{what}_gaps",
                "text": f"{name} has no number in {several(len(rows), 'row')}, the first of them "
                f"row {table.line(int(rows[0]))}",
                "action": f"the {what} columns are ignored; they are computed from the positions",
                "value": len(rows),
            }
        )
    columns = {name: values for name, values in table.columns.items() if name not in dropped}
    return replace(table, columns=columns), notes


def _is_of(name: str, prefix: str) -> bool:
    parsed = parse_name(name)
    return parsed is not None and parsed[0].prefix == prefix
