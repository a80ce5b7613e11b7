"""Times as dates and hours (ISO 8601) in seconds."""

from __future__ import annotations

import re
from datetime import UTC, datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robots.common.errors import InputError
from robots.common.tables.table import Table

FloatArray = NDArray[np.float64]

_FORM = re.compile(r"\s*(\d{4}-\d{2}-\d{2}[T ])?\d{2}:\d{2}:\d{2}([.,]\d+)?\s*(Z|[+-]\d{2}:?\d{2})?\s*")
_DAY = 86400.0


def seconds_since_1970(stamps: NDArray[np.datetime64]) -> FloatArray:
    """Gives stamps of time (N,) in seconds [s], to 0.2 us; NaN for a missing one."""
    whole = stamps.astype("datetime64[ns]")
    days = whole.astype("datetime64[D]")
    since: FloatArray = (whole - days) / np.timedelta64(1, "s") + (days - np.datetime64(0, "D")) / np.timedelta64(
        1, "D"
    ) * _DAY
    return since


def is_time(text: object) -> bool:
    """Whether a cell holds a time such as ``2024-05-03T12:34:56.789`` or ``12:34:56.789``."""
    return isinstance(text, str) and _FORM.fullmatch(text) is not None


def seconds_of(table: Table, name: str) -> FloatArray:
    """Reads a column of times of ISO 8601, with or without date and time zone; without a zone it is UTC.

    Args:
        table: as it was read.
        name: of a column of text.

    Returns:
        Seconds (N,) since 1970, or since midnight where there is no date [s].

    Raises:
        InputError: a cell that is no time, with its row.
    """
    texts = table.columns[name]
    plain = _by_numpy(texts)
    if plain is not None:
        return plain
    values = np.empty(len(texts))
    for row, text in enumerate(texts):
        try:
            if not is_time(text):
                raise ValueError("another form")
            values[row] = _seconds(str(text).strip().replace(",", "."))
        except ValueError as error:
            raise InputError(
                f"found {str(text)[:40]!r}",
                file=table.path,
                column=name,
                row=table.line(row),
                allowed="a time such as 2024-05-03T12:34:56.789 in all rows, or seconds in all rows",
                remedy="correct or remove the row",
            ) from error
    return values


def _by_numpy(texts: NDArray[Any]) -> FloatArray | None:
    """The fast way, for dates without a zone; None for other forms."""
    first = str(texts[0])
    if not is_time(first) or first[4:5] != "-" or re.search(r"(Z|[+-]\d{2}:?\d{2})\s*$", first[11:]) or "," in first:
        return None
    try:
        values = seconds_since_1970(texts.astype("U32").astype("datetime64[ns]"))
    except (ValueError, TypeError):
        return None
    return None if np.isnan(values).any() else values


def _seconds(text: str) -> float:
    if text[4:5] == "-":
        moment = datetime.fromisoformat(text)
        return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()
    hours, minutes, rest = text.split(":", 2)
    return 3600.0 * int(hours) + 60.0 * int(minutes) + float(rest)
