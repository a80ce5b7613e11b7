"""A log's table: its format recognised, its columns renamed, its times in seconds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from estimation.logs.columns import parse_name
from estimation.logs.formats import column_names, is_log_name, read_foreign
from estimation.logs.joint_numbers import NAMES, counted_from_one, named_as_in_file
from estimation.logs.mappings.mapped_tables import count_joints, map_table, stated_columns
from estimation.logs.mappings.mapping import LogMapping
from estimation.logs.needed_columns import is_needed
from estimation.logs.readers.compressed import unpacked
from estimation.logs.recorders import Recorder, recorder_of
from estimation.logs.torque_source import NO_TORQUE, TorqueSource
from robots.common.errors import InputError
from robots.common.tables.table import Table
from robots.common.tables.times import is_time, seconds_of

Notes = list[dict[str, Any]]

# Serial numbers of days in a spreadsheet, that of 1970, and the fastest step of a time in seconds.
SERIAL_DAYS, SERIAL_1970, FASTEST = (20_000.0, 80_000.0), 25_569.0, 1e-5

RATE_ERROR = 0.01
"""Relative difference between a stated rate and that of a column of time, from which on a note is a warning."""


def read_log_table(
    path: str | PathLike[str],
    n: int | None,
    mapping: LogMapping | None,
    joints: Sequence[str] | None,
    kinds: Sequence[str] | None = None,
) -> tuple[Table, Notes]:
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
    with unpacked(path, is_log_name) as place:
        table, notes = _log_table(place, n, mapping, joints, kinds)
    return replace(table, path=Path(path)), notes


def _log_table(
    path: Path,
    n: int | None,
    mapping: LogMapping | None,
    joints: Sequence[str] | None,
    kinds: Sequence[str] | None,
) -> tuple[Table, Notes]:
    names = column_names(path)
    if mapping is None or mapping.position is None:
        recorder = None if names is None else recorder_of(names)
        if recorder is not None:
            return _recognised(path, recorder, mapping, joints, kinds)
    known = LogMapping() if mapping is None else mapping
    stated = stated_columns(known, names, n)
    table, notes = _read(
        path,
        # Of arrays the columns are known only when they are read.
        lambda name: parse_name(name) is not None or name in stated or (names is None and mapping is not None),
        lambda name: name in stated or is_needed(name, names),
        topic=known.topic,
        joints=known.joints if known.joints is not None else joints,
    )
    table, in_file, more = counted_from_one(table, stated_columns(known, table.names, n))
    with named_as_in_file(in_file):
        if mapping is not None:
            table = _mapped(table, known, count_joints(known, table.names, n), kinds)
        table, dated = _without_serial_days(with_seconds(table, "t"))
        table, timed = _with_time(table, known)
    table = replace(table, metadata={**table.metadata, NAMES: in_file} if in_file else table.metadata)
    return _noted(table, [*notes, *more, *dated, *timed])


def _read(
    path: Path,
    wanted: Callable[[str], bool],
    needs: Callable[[str], bool],
    *,
    topic: str | None,
    joints: Sequence[str] | None,
) -> tuple[Table, Notes]:
    """Reads the wanted columns; one that is not needed and cannot be read is left out, with all of its quantity."""
    broken: set[str] = set()
    notes: Notes = []

    def kind(name: str) -> str:
        parsed = parse_name(name)
        return name if parsed is None else parsed[0].prefix

    while True:
        try:
            return read_foreign(
                path, lambda name: wanted(name) and kind(name) not in broken, topic=topic, joints=joints
            ), notes
        except InputError as error:
            if error.column is None or kind(error.column) in broken or needs(error.column):
                raise
            broken.add(kind(error.column))
            row = "" if error.row is None else f" in row {error.row}"
            notes.append(
                {
                    "name": "unreadable_column",
                    "text": f"{error.column}: {error.problem}{row}",
                    "action": "the columns of this quantity are ignored",
                    "value": 1,
                    "unit": "columns",
                }
            )


def _without_serial_days(table: Table) -> tuple[Table, Notes]:
    """Converts a spreadsheet's serial numbers of days to seconds since 1970.

    As seconds, rows at such numbers (1954 to 2119) would follow each other at more than 100 kHz.
    """
    times = table.columns.get("t")
    if times is None or table.is_text("t") or len(times) < 2 or not np.isfinite(times).all():
        return table, []
    first, last = SERIAL_DAYS
    if not (first < times.min() and times.max() < last and 0.0 < times[-1] - times[0] < FASTEST * (len(times) - 1)):
        return table, []
    note = {
        "name": "serial_days",
        "text": f"times from {times[0]:.6f} on are the days of a spreadsheet",
        "action": "they are converted to seconds",
        "value": len(times),
    }
    return replace(table, columns={**table.columns, "t": (times - SERIAL_1970) * 86400.0}), [note]


def _with_time(table: Table, mapping: LogMapping) -> tuple[Table, Notes]:
    """Adds the times of rows at a stated rate; a column of time that says otherwise is noted."""
    if mapping.rate is None:
        return table, []
    times = np.arange(len(table)) / mapping.rate
    own = table.columns.get("t")
    columns = {"t": times} | {name: values for name, values in table.columns.items() if name != "t"}
    text, differs = f"times of {mapping.rate:g} rows per second, as stated", False
    if own is not None:
        step = np.nan if table.is_text("t") or len(own) < 2 else float(np.median(np.diff(own)))
        differs = not abs(step * mapping.rate - 1.0) <= RATE_ERROR
        text += f"; the column of time, with steps of {step:.4g} s, is not read" if differs else ""
    note = {
        "name": "stated_rate",
        "text": text,
        "action": "state no rate if the column of time is right" if differs else "the rows are taken as evenly spaced",
        "value": mapping.rate,
        "unit": "Hz",
        "severity": "warning" if differs else "info",
    }
    return replace(table, columns=columns), [note]


def _recognised(
    path: Path,
    recorder: Recorder,
    mapping: LogMapping | None,
    joints: Sequence[str] | None,
    kinds: Sequence[str] | None,
) -> tuple[Table, Notes]:
    wanted = recorder.wanted.fullmatch
    table = read_foreign(path, lambda name: mapping is not None or wanted(name) is not None)
    # Names in the mapping are those of the file, in the robot's order.
    known = recorder.understood(table, joints if mapping is None or mapping.joints is None else mapping.joints)
    stated = {} if mapping is None else {name: getattr(mapping, name) for name in mapping.model_fields_set}
    source = None if "torque" in stated or "current" in stated else known.source
    if "torque" in stated:
        stated.setdefault("current", None)
    elif "current" in stated:
        stated.setdefault("torque", None)
    merged = known.mapping.model_copy(update=stated)
    if merged.torque is None and merged.current is None and known.source is None:
        table = replace(table, metadata={**table.metadata, NO_TORQUE: f"{recorder.name}: {known.remedy}"})
    if source is not None:
        table = replace(table, metadata={**table.metadata, "torque_source": source.to_dict()})
    table, timed = _with_time(_mapped(table, merged, known.joints, kinds), merged)
    return _noted(table, timed)


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
        if (finer := mapping.time.nanoseconds) is not None:
            table = _with_nanoseconds(table, name, finer)
    # A log of another number of joints than the robot's is refused later, with both numbers.
    own = kinds if kinds is not None and len(kinds) == joints else None
    mapped = map_table(with_seconds(table, "t"), mapping, joints, own)
    kept = {name: values for name, values in mapped.columns.items() if parse_name(name) is not None}
    left = tuple(name for name in mapped.columns if name not in kept)
    return replace(mapped, columns=kept, skipped=(*mapped.skipped, *left))


def _with_nanoseconds(table: Table, name: str, finer: str) -> Table:
    """Adds a column of nanoseconds to that of whole seconds."""
    for column in (name, finer):
        if column not in table.columns or table.is_text(column):
            problem = "the column holds text" if column in table.columns else "the column is missing"
            raise InputError(problem, file=table.path, column=column, allowed="whole seconds, and nanoseconds")
    whole = table.columns[name] + 1e-9 * table.columns[finer]
    return replace(table, columns={**{k: v for k, v in table.columns.items() if k != finer}, name: whole})


def with_seconds(table: Table, name: str) -> Table:
    """Converts a column of dates and times to seconds; other columns stay as they are.

    Args:
        table: as it was read.
        name: of the column; it may be missing.
    """
    if name not in table.columns or not table.is_text(name) or not is_time(table.columns[name][0]):
        return table
    return replace(table, columns={**table.columns, name: seconds_of(table, name)})


def _noted(table: Table, notes: Notes) -> tuple[Table, Notes]:
    source = table.metadata.get("torque_source")
    # A file may state anything under this key.
    if not isinstance(source, dict) or set(source) != set(TorqueSource.__dataclass_fields__):
        return table, notes
    return table, [TorqueSource(**source).note(len(table)), *notes]
