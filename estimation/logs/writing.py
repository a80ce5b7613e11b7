"""Logs to CSV and Parquet files."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike

import numpy as np

from estimation.logs.columns import QUANTITIES, column_name
from robots.common.errors import InputError
from robots.common.tables.table import Column
from robots.common.tables.table_files import write_table
from robots.signals import Log

_OF_THE_FILE = ("file", "ignored_columns", "repairs", "units")


def write_log(path: str | PathLike[str], log: Log, force: bool = False, *, kinds: Sequence[str] | None = None) -> None:
    """Writes a log so that `read_log` returns it bit by bit.

    Args:
        path: a ``.csv`` or ``.parquet`` file.
        log: the log.
        force: whether an existing file may be replaced.
        kinds: "revolute" or "prismatic" of each joint, for the units that the file states; all revolute by default.

    Raises:
        InputError: another number of kinds than joints; the file exists and ``force`` is not set, or it cannot be
            written.
    """
    if kinds is not None and len(kinds) != log.n:
        raise InputError(f"{len(kinds)} joint kinds", file=path, allowed=f"{log.n}, one per joint")
    linear = [joint for joint, kind in enumerate(kinds or (), start=1) if kind == "prismatic"]
    columns: dict[str, Column] = {}
    units: dict[str, str] = {}
    for quantity in QUANTITIES:
        signal = getattr(log, quantity.field)
        if signal is None:
            continue
        if quantity.field in ("segment", "cycle"):
            signal = signal.astype(np.int64)
        parts = {quantity.prefix: signal}
        if quantity.per_joint:
            parts = {column_name(quantity, joint + 1): signal[:, joint] for joint in range(log.n)}
        columns.update(parts)
        if quantity.unit:
            units.update(dict.fromkeys(parts, quantity.unit))
        for joint in linear if quantity.per_joint and quantity.linear_unit else ():
            units[column_name(quantity, joint)] = quantity.linear_unit
    metadata = {key: value for key, value in log.metadata.items() if key not in _OF_THE_FILE}
    write_table(path, columns, metadata, units=units, force=force)
