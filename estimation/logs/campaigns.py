"""A folder of logs: one campaign on one clock."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from os import PathLike
from pathlib import Path

from estimation.logs.clocks import do_not_overlap
from estimation.logs.formats import SUFFIXES, is_log_name
from robots.common.errors import InputError
from robots.signals import Log

MAPPING = "mapping.yaml"


def in_natural_order(paths: Iterable[Path]) -> list[Path]:
    """Sorts files by name, numbers in them by value: `run7` comes before `run10`.

    Args:
        paths: of the files.
    """

    def key(path: Path) -> list[str | int]:
        # Text and numbers take turns, so that like is compared with like.
        return [int(part) if k % 2 else part for k, part in enumerate(re.split(r"(\d+)", str(path)))]

    return sorted(paths, key=key)


def log_files(folder: str | PathLike[str]) -> list[Path]:
    """Lists the logs in a folder, in natural order of their names.

    Args:
        folder: of files of any known format, or of folders of rosbag 2.

    Raises:
        InputError: no log in it.
    """
    place = Path(folder)
    try:
        entries = in_natural_order(place.iterdir())
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror or error})", file=place) from error
    found = [entry for entry in entries if not entry.name.startswith(".") and is_log_name(entry)]
    if not found:
        raise InputError("no logs in the folder", file=place, allowed=", ".join(SUFFIXES), kind="no_logs")
    return found


def in_order(logs: Sequence[Log]) -> tuple[Log, ...]:
    """Sorts the logs of a campaign by time, where they are on one clock; else they keep their order.

    Logs that overlap in time, such as logs that all start at zero, are on clocks of their own.

    Args:
        logs: of one folder.
    """
    return tuple(sorted(logs, key=lambda log: float(log.t[0]))) if do_not_overlap(logs) else tuple(logs)
