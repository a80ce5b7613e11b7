"""Which reader a log needs, by its name."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from os import PathLike
from pathlib import Path

from estimation.logs.readers.matlab_files import read_matlab
from estimation.logs.readers.numpy_files import read_npz
from estimation.logs.readers.ros_bags import read_bag
from robots.common.errors import InputError
from robots.common.files import existing_file
from robots.common.tables.csv_tables import read_csv
from robots.common.tables.table import Table
from robots.common.tables.table_files import read_table

CSV = (".csv", ".txt", ".tsv", ".dat")
BAGS = (".bag", ".mcap", ".db3")
SUFFIXES = (*CSV, ".parquet", ".mat", ".npz", *BAGS)


def is_bag_folder(path: Path) -> bool:
    """Whether a folder is a recording of rosbag 2, which is one log."""
    return path.is_dir() and (path / "metadata.yaml").is_file()


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
        InputError: an unknown suffix, or a file that cannot be read.
    """
    place = Path(path)
    if is_bag_folder(place):
        return read_bag(place, topic=topic, joints=joints)
    place = existing_file(place)
    suffix = place.suffix.lower()
    if suffix in BAGS:
        if place.stat().st_size == 0:
            raise InputError("the file is empty", file=place)
        return read_bag(place, topic=topic, joints=joints)
    if suffix == ".mat":
        return read_matlab(place, wanted)
    if suffix == ".npz":
        return read_npz(place, wanted)
    if suffix in CSV:
        return read_csv(place, wanted)
    if suffix == ".parquet":
        return read_table(place, wanted=wanted)
    raise InputError(
        f"a file of type {place.suffix or '(none)'!r}", file=place, allowed=", ".join(SUFFIXES), remedy="rename it"
    )
