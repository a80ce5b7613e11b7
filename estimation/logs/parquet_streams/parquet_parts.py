"""One part of a log in Parquet files: its columns, row groups and times, without its data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from estimation.logs.columns import parse_name, refuse_text, unit_factors
from estimation.logs.joint_numbers import renamed_joints
from estimation.logs.mappings.mapped_tables import count_joints, map_table, mapped_sources, stated_columns
from estimation.logs.mappings.mapping import LogMapping
from estimation.logs.mappings.suggestions import PLAIN_REMEDY, remedy_for_columns
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.tables.table import Table
from robots.common.tables.table_files import parquet_column, stored_in

# Signals that an identification uses, and those of a mapping that it does not.
FIELDS = ("t", "q", "tau", "current")
UNUSED = ("velocity", "acceleration", "temperature", "link_position", "ambient", "segment", "cycle")
# A row group is read as a whole: one of more values (3 * 10^6 rows of six joints) takes half a gigabyte.
MOST_VALUES = 40_000_000


@dataclass(frozen=True, eq=False)
class Part:
    """One file.

    Attributes:
        head: the file without its rows: what it says of itself, and the units of its columns.
        groups: rows of each row group.
        joints: number of joints.
        columns: names of the columns that are read.
        mapping: what they mean, where their names do not say it.
        kinds: "revolute" or "prismatic" of each joint, where they are known.
        renamed: the log's names of columns whose joints are counted from 0.
        start: first time [s].
        end: last time [s].
        period: median step of time in the first row group [s].
    """

    head: Table
    groups: tuple[int, ...]
    joints: int
    columns: tuple[str, ...]
    mapping: LogMapping | None
    kinds: Sequence[str] | None
    renamed: Mapping[str, str] = field(default_factory=dict)
    start: float = 0.0
    end: float = 0.0
    period: float = 0.0

    @property
    def path(self) -> Path:
        """The file."""
        return self.head.path

    @property
    def rows(self) -> int:
        """Number of rows."""
        return sum(self.groups)

    def signals(self, table: pa.Table) -> dict[str, Array]:
        """Gives t (N,) and q, tau or current (N, n) of a row group, in SI units."""
        columns = self._converted(table, self.columns, self.mapping)
        found = {"t": columns["t"]}
        torque = "tau" if "tau1" in columns else "i"
        for prefix, signal in (("q", "q"), (torque, "tau" if torque == "tau" else "current")):
            found[signal] = np.stack([columns[f"{prefix}{joint + 1}"] for joint in range(self.joints)], axis=1)
        return found

    def times(self, table: pa.Table) -> Array:
        """Gives the times of a table that holds their column only [s] (N,)."""
        named = LogMapping(time=self.mapping.time) if self.mapping is not None and self.mapping.time else None
        return self._converted(table, table.column_names, named)["t"]

    @property
    def time_column(self) -> str:
        """Name of the column of times."""
        named = None if self.mapping is None else self.mapping.time
        return "t" if named is None else named.column

    def _converted(self, table: pa.Table, names: Sequence[str], mapping: LogMapping | None) -> dict[str, Array]:
        read = replace(self.head, columns={name: parquet_column(table.column(name), name, self.path) for name in names})
        for name in names:
            refuse_text(read, name)
        if self.renamed:
            read = replace(
                read,
                columns={self.renamed.get(name, name): values for name, values in read.columns.items()},
                units={self.renamed.get(name, name): unit for name, unit in read.units.items()},
            )
        if mapping is not None:
            read = map_table(read, mapping, self.joints, self.kinds)
        parsed = ((name, parse_name(name)) for name in read.names)
        quantities = {name: found[0] for name, found in parsed if found is not None and found[0].field in FIELDS}
        factors, _ = unit_factors(read, quantities, self.kinds)
        return {name: read.columns[name] * factor for name, factor in factors.items()}


def open_part(path: Path, n: int | None, kinds: Sequence[str] | None, mapping: LogMapping | None = None) -> Part:
    """Reads the head of a file, and its first and last times.

    Args:
        path: a Parquet file.
        n: number of joints of the robot, where it is known.
        kinds: "revolute" or "prismatic" of each joint.
        mapping: what the columns mean, where their names do not say it.

    Raises:
        InputError: a file that is empty or cut off, lacks a column, or has row groups that are too large.
    """
    if mapping is not None:
        if mapping.rate is not None:
            raise InputError(
                "a stated rate, but the log is read in pieces",
                file=path,
                remedy="add a column t [s] to the files, or read the log at once with --no-stream",
            )
        if mapping.time is not None and mapping.time.nanoseconds is not None:
            raise InputError(
                "time in two columns, but the log is read in pieces",
                file=path,
                column=mapping.time.nanoseconds,
                remedy="add a column t [s] to the files, or read the log at once with --no-stream",
            )
        mapping = mapping.model_copy(update=dict.fromkeys(UNUSED))
    try:
        with pq.ParquetFile(path) as file:
            groups = tuple(file.metadata.row_group(k).num_rows for k in range(file.metadata.num_row_groups))
            if not sum(groups):
                raise InputError("the part has no rows", file=path, remedy="remove the file from the folder")
            names = file.schema_arrow.names
            stored, units = stored_in(file.schema_arrow.metadata or {})
            renamed = renamed_joints(names, stated_columns(mapping or LogMapping(), names, n))
            lists = [column.name for column in file.schema_arrow if pa.types.is_nested(column.type)]
            joints, chosen = _chosen(path, [renamed.get(name, name) for name in names], n, mapping, lists)
            in_file = {log: name for name, log in renamed.items()}
            chosen = [in_file.get(name, name) for name in chosen]
            if max(groups) * len(chosen) > MOST_VALUES:
                raise InputError(
                    f"a row group of {max(groups)} rows",
                    file=path,
                    allowed=f"{MOST_VALUES // len(chosen)} rows at most, for a row group is read as a whole",
                    remedy="write the file with smaller row groups (pyarrow: row_group_size=1000000)",
                )
            head = Table(columns={}, metadata=stored, path=path, first_row=1, units=units)
            part = Part(head, groups, joints, tuple(chosen), mapping, kinds, renamed)
            full = [k for k, rows in enumerate(groups) if rows]
            first, last = (part.times(file.read_row_group(k, [part.time_column])) for k in (full[0], full[-1]))
            # A mapping that does not suit the columns is refused now, not after an hour.
            part.signals(pa.Table.from_batches([next(file.iter_batches(1, columns=list(part.columns)))]))
    except (pa.ArrowException, OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            f"not a whole Parquet file ({str(error).splitlines()[0] if str(error) else 'damaged'})",
            file=path,
            remedy="write the part again, or remove it from the folder if its recording was cut off",
        ) from error
    period = float(np.median(np.diff(first))) if len(first) > 1 else 0.0
    return replace(part, start=float(first[0]), end=float(last[-1]), period=period)


def _chosen(
    path: Path, names: Sequence[str], n: int | None, mapping: LogMapping | None, lists: Sequence[str]
) -> tuple[int, list[str]]:
    """Counts the joints and names the columns that are read: t, q1.. and tau1.., or i1.. without torque."""
    if mapping is None:
        joints = n or sum(name.startswith("q") and name[1:].isdigit() for name in names)
        named: list[str] = []
    else:
        joints = count_joints(mapping, names, n)
        named = mapped_sources(mapping, names, joints)
    torque = "tau" if "tau1" in names else "i"
    # Quantities that a mapping leaves out have the names of a log.
    left = {
        "t": mapping is None or mapping.time is None,
        "q": mapping is None or mapping.position is None,
        torque: mapping is None or (mapping.torque is None and mapping.current is None),
    }
    wanted = [*(["t"] if left["t"] else []), *(f"{k}{j + 1}" for k in ("q", torque) if left[k] for j in range(joints))]
    for name in wanted:
        if name not in names and lists:
            raise InputError(
                f"the column is missing, and lists ({', '.join(lists[:3])}) are not read in pieces",
                file=path,
                column=name,
                remedy="read the log at once with --no-stream, or store one number per column",
            )
        if name not in names or (name == "t" and joints == 0):
            raise InputError(
                "the column is missing",
                file=path,
                column="tau1" if name == "i1" else name,
                allowed=f"t, q1..q{joints} and tau1..tau{joints} or i1..i{joints}",
                remedy=PLAIN_REMEDY if mapping else remedy_for_columns(names, n),
            )
    more = f"q{joints + 1}"
    if left["q"] and more in names:
        raise InputError(
            f"the robot has {joints} joints",
            file=path,
            column=more,
            remedy="choose the robot of the log",
            kind="other_joints",
        )
    return joints, [*named, *(name for name in wanted if name not in named)]
