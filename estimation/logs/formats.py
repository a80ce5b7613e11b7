"""Which reader a log needs, by its name and by its content."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from os import PathLike
from pathlib import Path

from estimation.logs.readers import compressed
from estimation.logs.readers.franka_states import HEAD, franka_names, is_franka_states, read_franka_states
from estimation.logs.readers.json_tables import read_json
from estimation.logs.readers.matlab_files import read_matlab
from estimation.logs.readers.numpy_files import read_npz
from estimation.logs.readers.ros_bags import read_bag
from estimation.logs.readers.torch_files import read_torch
from robots.common.errors import InputError
from robots.common.files import existing_file
from robots.common.tables.csv_tables import csv_names, read_csv
from robots.common.tables.table import Table
from robots.common.tables.table_files import parquet_names, read_parquet

CSV = (".csv", ".txt", ".tsv", ".dat")
BAGS = (".bag", ".mcap", ".db3")
JSON_LINES = (".jsonl", ".ndjson")
SUFFIXES = (*CSV, ".parquet", ".mat", ".npz", ".pt", *JSON_LINES, *BAGS)
_MAGIC = {
    b"#ROSBAG V2.0": ".bag",
    b"\x89MCAP0\r\n": ".mcap",
    b"SQLite format 3\0": ".db3",
    b"PK\x03\x04": ".npz",
    b"PAR1": ".parquet",
    b"MATLAB ": ".mat",
    b"\x89HDF\r\n\x1a\n": ".mat",
}


def is_bag_folder(path: Path) -> bool:
    """Whether a folder is a recording of rosbag 2, which is one log."""
    return path.is_dir() and (path / "metadata.yaml").is_file()


def is_log_name(path: Path) -> bool:
    """Whether something in a folder is a log, by its name: a file of a known format, compressed or not, or a bag.

    Files ``.json`` are not: results of this software are.

    Args:
        path: an existing file or folder.
    """
    inner = path.with_suffix("") if path.suffix.lower() in compressed.SUFFIXES else path
    return is_bag_folder(path) or (path.is_file() and inner.suffix.lower() in SUFFIXES)


def form_of(path: Path) -> str:
    """Finds the format of a file: by its first bytes where the name does not say it.

    Args:
        path: an existing file.

    Returns:
        The suffix of the format; ``franka`` for robot states that libfranka printed, ``json`` for any JSON.

    Raises:
        InputError: a file of no known format.
    """
    suffix = path.suffix.lower()
    if suffix in SUFFIXES and suffix not in (*CSV, *JSON_LINES):
        return suffix
    with path.open("rb") as stream:
        head = stream.read(HEAD)
    magic = next((form for mark, form in _MAGIC.items() if head.startswith(mark)), None)
    if magic is not None:
        return magic
    if is_franka_states(head):
        return "franka"
    if suffix in (*JSON_LINES, ".json") or head.lstrip(b"\xef\xbb\xbf \r\n\t").startswith((b'{"', b'[{"')):
        return "json"
    if suffix in CSV:
        return suffix
    if suffix in (".log", ".asc", "") and head and b"\0" not in head:
        return ".csv"
    raise InputError(
        f"a file of type {path.suffix or '(none)'!r}",
        file=path,
        allowed=", ".join(SUFFIXES),
        remedy="rename it",
        kind="unknown_file_type",
    )


def column_names(path: str | PathLike[str]) -> list[str] | None:
    """Lists the columns of a table without reading it; None where only reading would show them.

    Args:
        path: a log.

    Raises:
        InputError: a missing file, or a head that cannot be read.
    """
    place = Path(path)
    if place.is_dir():
        return None
    place = existing_file(place)
    form = form_of(place)
    if form in CSV:
        return csv_names(place)
    if form == ".parquet":
        return parquet_names(place)
    return franka_names(place) if form == "franka" else None


def read_foreign(
    path: str | PathLike[str],
    wanted: Callable[[str], bool],
    *,
    topic: str | None = None,
    joints: Sequence[str] | None = None,
) -> Table:
    """Reads a file of any known format as a table.

    Args:
        path: the file, or the folder of a rosbag 2.
        wanted: selects by name which columns to read.
        topic: of a bag.
        joints: of a bag: names in the robot's order.

    Raises:
        InputError: an unknown format, or a file that cannot be read.
    """
    place = Path(path)
    if is_bag_folder(place):
        return read_bag(place, topic=topic, joints=joints)
    place = existing_file(place)
    form = form_of(place)
    if form in BAGS:
        if place.stat().st_size == 0:
            raise InputError("the file is empty", file=place, kind="empty_file")
        return read_bag(place, topic=topic, joints=joints)
    readers: dict[str, Callable[[Path, Callable[[str], bool]], Table]] = {
        ".mat": read_matlab,
        ".npz": read_npz,
        ".pt": read_torch,
        ".parquet": read_parquet,
        "franka": read_franka_states,
        "json": read_json,
    }
    return readers.get(form, read_csv)(place, wanted)
