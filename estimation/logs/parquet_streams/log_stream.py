"""A log too large for the memory: Parquet files that are read by ranges of rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from os import PathLike
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from estimation.logs.campaigns import MAPPING, in_natural_order
from estimation.logs.mappings.mapping import LogMapping, read_mapping
from estimation.logs.parquet_streams.parquet_parts import Part, open_part
from estimation.logs.torque_source import parse_meaning
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.files import sha256
from robots.signals import Log

# A log of more rows is not read into memory unless the user asks for it: at 0.75 GB per 10^6 rows of six joints it
# would take 4 GB.
LARGE = 5_000_000
# A step of the clock of more than so many periods between two parts is a pause.
PAUSE = 8.0


@dataclass(frozen=True, eq=False)
class LogStream:
    """A log in one or several Parquet files on one clock. Only some of its rows are in memory at a time.

    Attributes:
        path: the file, or the folder of the parts.
        parts: the files in the order of their clock.
        payload: see `Log`.
        gravity: see `Log`.
        torque_is: see `estimation.logs.torque_source.parse_meaning`; None for joint torques.
    """

    path: Path
    parts: tuple[Part, ...]
    payload: Array | None = None
    gravity: Array | None = None
    torque_is: str | None = None
    _groups: dict[tuple[int, int], dict[str, Array]] = field(default_factory=dict, repr=False)

    def __len__(self) -> int:
        return sum(part.rows for part in self.parts)

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.parts[0].joints

    def runs(self) -> list[tuple[int, int]]:
        """Ranges of rows without a pause between parts: (first, stop) of each."""
        borders, at = [0], 0
        for before, after in pairwise(self.parts):
            at += before.rows
            if after.start - before.end > PAUSE * before.period:
                borders.append(at)
        return list(pairwise([*borders, len(self)]))

    def rows(self, first: int, stop: int) -> Log:
        """Reads some rows.

        Args:
            first: of the rows, counted from 0 over all parts.
            stop: the row after the last one.

        Raises:
            InputError: a value that is not finite or a time that does not increase, with part, column and row.
        """
        found: dict[str, list[Array]] = {}
        at = 0
        for number, part in enumerate(self.parts):
            for group, count in enumerate(part.groups):
                begin, end = max(first, at), min(stop, at + count)
                if begin < end:
                    for name, values in self._group(number, group).items():
                        found.setdefault(name, []).append(values[begin - at : end - at])
                at += count
        signals = {name: np.concatenate(values) for name, values in found.items()}
        try:
            return Log(
                t=signals["t"],
                q=signals["q"],
                tau=signals.get("tau"),
                current=signals.get("current"),
                payload=self.payload,
                gravity=self.gravity,
                name=self.path.stem,
            )
        except InputError as error:
            row = 0 if error.row is None else error.row - 1
            part, inside = self.place(first + row)
            raise InputError(
                error.problem,
                file=part.path,
                column=error.column,
                row=None if error.row is None else inside + 1,
                joint=error.joint,
                allowed=error.allowed,
                remedy="repair or remove these rows: a log that is read in pieces is not repaired",
            ) from error

    def place(self, row: int) -> tuple[Part, int]:
        """Gives the part that holds a row, and the row's place in it, both counted from 0."""
        for part in self.parts:
            if row < part.rows:
                return part, row
            row -= part.rows
        return self.parts[-1], self.parts[-1].rows

    def describe(self) -> list[dict[str, object]]:
        """Lists name, hash, rows, start and duration [s] of each part, see `describe_logs`."""
        return [
            {
                "name": part.path.stem,
                "sha256": sha256(part.path),
                "samples": part.rows,
                "start": part.start,
                "duration": part.end - part.start,
            }
            for part in self.parts
        ]

    def _group(self, number: int, group: int) -> dict[str, Array]:
        """Signals of one row group; the latest two are kept, for pieces overlap."""
        key = (number, group)
        if key not in self._groups:
            while len(self._groups) > 1:
                del self._groups[next(iter(self._groups))]
            part = self.parts[number]
            try:
                with pq.ParquetFile(part.path) as file:
                    table = file.read_row_group(group, columns=list(part.columns))
                self._groups[key] = part.signals(table)
            except (pa.ArrowException, OSError, ValueError) as error:
                raise InputError(
                    f"row group {group + 1} cannot be read ({str(error).splitlines()[0]})",
                    file=part.path,
                    remedy="write the part again",
                ) from error
        return self._groups[key]


def parquet_parts(path: str | PathLike[str]) -> list[Path]:
    """Lists the Parquet files of a file or a folder; empty where it is something else."""
    place = Path(path)
    if not place.is_dir():
        return [place] if place.suffix.lower() == ".parquet" and place.is_file() else []
    return in_natural_order(
        entry for entry in place.iterdir() if entry.suffix.lower() == ".parquet" and entry.is_file()
    )


def is_large(paths: Sequence[str | PathLike[str]]) -> bool:
    """Whether the logs are one Parquet file or folder of more than `LARGE` rows, by the files' own heads."""
    parts = parquet_parts(paths[0]) if len(paths) == 1 else []
    try:
        return sum(pq.read_metadata(part).num_rows for part in parts) > LARGE
    except (pa.ArrowException, OSError, ValueError):
        return False


def open_stream(
    path: str | PathLike[str],
    n: int | None = None,
    *,
    kinds: Sequence[str] | None = None,
    torque_is: str | None = None,
    mapping: LogMapping | str | PathLike[str] | None = None,
) -> LogStream:
    """Opens a Parquet file, or a folder of them, as one log; the data stay on the disk.

    Args:
        path: a file, or a folder of parts on one clock, in any order. Pauses between parts are allowed.
        n: number of joints of the robot, where it is known.
        kinds: "revolute" or "prismatic" of each joint.
        torque_is: what the torque columns hold, if not joint torques.
        mapping: see `read_log`; without one, a ``mapping.yaml`` in the folder is that of its parts.

    Returns:
        The log.

    Raises:
        InputError: no Parquet file; a part that is empty, cut off, has other columns than the first, or overlaps
            another in time.
    """
    files = parquet_parts(path)
    if not files:
        raise InputError(
            "no Parquet file, nor a folder of them", file=path, remedy="write the log as Parquet to read it in pieces"
        )
    own = Path(path) / MAPPING
    if mapping is None and own.is_file():
        mapping = own
    known = mapping if isinstance(mapping, LogMapping) or mapping is None else read_mapping(mapping)
    opened = [open_part(file, n, kinds, known) for file in files]
    for part in opened[1:]:
        if set(part.columns) != set(opened[0].columns):
            other = sorted(set(part.columns) ^ set(opened[0].columns))
            raise InputError(
                f"other columns than in {opened[0].path.name}: {', '.join(other)}",
                file=part.path,
                remedy="give parts of one recording, with the same columns",
            )
    opened.sort(key=lambda part: part.start)
    for before, after in pairwise(opened):
        if after.start <= before.end:
            raise InputError(
                f"begins at {after.start:.6f} s, before {before.path.name} ends ({before.end:.6f} s)",
                file=after.path,
                column=after.time_column,
                allowed="parts on one clock that do not overlap in time",
                remedy="remove rows that are in both parts; if the clock was set back, give the parts as logs of their "
                "own",
            )
    if torque_is is None and known is not None and known.torque_is is not None:
        torque_is = known.torque_is
        parse_meaning(torque_is, opened[0].joints)
    return LogStream(Path(path), tuple(opened), torque_is=torque_is)
