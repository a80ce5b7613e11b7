"""One part of a log in Parquet files: its columns, row groups and times, without its data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from estimation.logs.columns import Quantity, column_name, parse_name, unit_factors
from robots.common.errors import InputError
from robots.common.tables.table import Table
from robots.common.tables.table_files import stored_in

Array = NDArray[np.float64]

# Signals that an identification uses.
FIELDS = ("t", "q", "tau", "current")
# A row group is read as a whole: one of more values (3 * 10^6 rows of six joints) takes half a gigabyte.
MOST_VALUES = 40_000_000


@dataclass(frozen=True, eq=False)
class Part:
    """One file.

    Attributes:
        path: the file.
        groups: rows of each row group.
        joints: number of joints.
        factors: by which each column becomes SI.
        start: first time [s].
        end: last time [s].
        period: median step of time in the first row group [s].
    """

    path: Path
    groups: tuple[int, ...]
    joints: int
    factors: Mapping[str, float]
    start: float
    end: float
    period: float

    @property
    def rows(self) -> int:
        """Number of rows."""
        return sum(self.groups)

    def signals(self, table: pa.Table) -> dict[str, Array]:
        """Gives t (N,) and q, tau or current (N, n) of a row group, in SI units."""
        columns = {name: _column(table, name) * factor for name, factor in self.factors.items()}
        found = {"t": columns.pop("t")}
        for quantity in _quantities(columns).values():
            names = [column_name(quantity, joint + 1) for joint in range(self.joints)]
            found[quantity.field] = np.stack([columns[name] for name in names], axis=1)
        return found


def open_part(path: Path, n: int | None, kinds: Sequence[str] | None) -> Part:
    """Reads the head of a file, and its first and last times.

    Args:
        path: a Parquet file.
        n: number of joints of the robot, where it is known.
        kinds: "revolute" or "prismatic" of each joint.

    Raises:
        InputError: a file that is empty or cut off, lacks a column, or has row groups that are too large.
    """
    try:
        with pq.ParquetFile(path) as file:
            groups = tuple(file.metadata.row_group(k).num_rows for k in range(file.metadata.num_row_groups))
            if not sum(groups):
                raise InputError("the part has no rows", file=path, remedy="remove the file from the folder")
            names = file.schema_arrow.names
            stored, units = stored_in(file.schema_arrow.metadata or {})
            chosen = _chosen(path, names, n)
            if max(groups) * len(chosen) > MOST_VALUES:
                raise InputError(
                    f"a row group of {max(groups)} rows",
                    file=path,
                    allowed=f"{MOST_VALUES // len(chosen)} rows at most, for a row group is read as a whole",
                    remedy="write the file with smaller row groups (pyarrow: row_group_size=1000000)",
                )
            full = [k for k, rows in enumerate(groups) if rows]
            first, last = (_column(file.read_row_group(k, columns=["t"]), "t") for k in (full[0], full[-1]))
    except (pa.ArrowException, OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            f"not a whole Parquet file ({str(error).splitlines()[0] if str(error) else 'damaged'})",
            file=path,
            remedy="write the part again, or remove it from the folder if its recording was cut off",
        ) from error
    table = Table(columns=dict.fromkeys(chosen, first[:1]), metadata=stored, path=path, first_row=1, units=units)
    factors, _ = unit_factors(table, _quantities(chosen), kinds)
    scale = factors["t"]
    period = float(np.median(np.diff(first))) if len(first) > 1 else 0.0
    joints = sum(name.startswith("q") for name in chosen)
    return Part(path, groups, joints, factors, float(first[0]) * scale, float(last[-1]) * scale, period * scale)


def _quantities(names: Mapping[str, object] | Sequence[str]) -> dict[str, Quantity]:
    parsed = ((name, parse_name(name)) for name in names)
    return {name: found[0] for name, found in parsed if found is not None and found[0].field in FIELDS}


def _chosen(path: Path, names: Sequence[str], n: int | None) -> list[str]:
    """Names the columns that are read: t, q1.. and tau1.., or i1.. without torque."""
    joints = n or sum(name.startswith("q") and name[1:].isdigit() for name in names)
    torque = "tau" if "tau1" in names else "i"
    wanted = ["t", *(f"{kind}{joint + 1}" for kind in ("q", torque) for joint in range(joints))]
    for name in wanted:
        if name not in names or (name == "t" and joints == 0):
            raise InputError(
                "the column is missing",
                file=path,
                column="tau1" if name == "i1" else name,
                allowed=f"t, q1..q{joints} and tau1..tau{joints} or i1..i{joints}",
                remedy="rename the columns, or read the log whole with --no-stream: in pieces it takes no mapping",
            )
    more = f"q{joints + 1}"
    if more in names:
        raise InputError(f"the robot has {joints} joints", file=path, column=more, remedy="choose the robot of the log")
    return wanted


def _column(table: pa.Table, name: str) -> Array:
    column = table.column(name)
    if not (pa.types.is_integer(column.type) or pa.types.is_floating(column.type)):
        raise ValueError(f"column {name} is of type {column.type}, not a number")
    return np.asarray(column.cast(pa.float64(), safe=False).to_numpy(), dtype=float)
