"""Times as dates and hours in seconds: by ISO 8601, and as spreadsheets write them."""

from __future__ import annotations

import re
from datetime import UTC, datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.tables.table import Table

_FORM = re.compile(r"\s*(\d{4}-\d{2}-\d{2}[T ])?\d{2}:\d{2}:\d{2}([.,]\d+|:(\d{3}){1,3})?\s*(Z|[+-]\d{2}:?\d{2})?\s*")
# Milli-, micro- or nanoseconds behind a colon, as 12:34:56:789.
_COLON = re.compile(r"(\d{2}:\d{2}:\d{2}):(\d{3,9})")
SECONDS_PER_HOUR, SECONDS_PER_DAY = 3600.0, 86_400.0
YEAR_2000 = 946_684_800.0  # [s since 1970]; earlier times are counted from another start
# Spreadsheets: 3.5.2024 12:34:56,789; 5/3/2024 1:02:03.5 PM; 2024/05/03 12:34. Without a date also 34:56.7, which is
# minutes and seconds: the form in which they write back a time with milliseconds.
_SHEET = re.compile(
    r"\s*(?:(?P<date>\d{1,4}(?P<mark>[-/.])\d{1,2}(?P=mark)\d{1,4})[ T,]\s*)?"
    r"(?P<hours>\d{1,2}):(?P<minutes>\d{2})(?::(?P<seconds>\d{2}(?:[.,]\d+)?))?\s*(?P<half>[AaPp]\.?[Mm]\.?)?\s*"
)
_MINUTES = re.compile(r"\s*(?P<minutes>\d{1,2}):(?P<seconds>\d{2}[.,]\d+)\s*")


def seconds_since_1970(stamps: NDArray[np.datetime64]) -> Array:
    """Gives stamps of time (N,) in seconds [s], to 0.2 us; NaN for a missing one."""
    whole = stamps.astype("datetime64[ns]")
    days = whole.astype("datetime64[D]")
    since: Array = (whole - days) / np.timedelta64(1, "s") + (days - np.datetime64(0, "D")) / np.timedelta64(
        1, "D"
    ) * SECONDS_PER_DAY
    return since


def is_time(text: object) -> bool:
    """Whether a cell holds a time such as ``2024-05-03T12:34:56.789``, ``12:34:56.789`` or ``3.5.2024 12:34``."""
    return isinstance(text, str) and (_FORM.fullmatch(text) is not None or _sheet_parts(text) is not None)


def seconds_of(table: Table, name: str) -> Array:
    """Reads a column of times, with or without date and time zone; without a zone it is UTC.

    Dates are those of ISO 8601 or of spreadsheets. Of ``5/3/2024`` the first number is the day if another date of the
    column has a first number above 12, or if the column is shorter so; else it is the month. With points it is the day.
    Times without a date go on after midnight, and minutes without an hour after the full hour.

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
    iso = is_time(texts[0]) and _FORM.fullmatch(str(texts[0])) is not None
    if not iso:
        return _of_sheet(table, name)
    values = np.empty(len(texts))
    for row, text in enumerate(texts):
        try:
            if not isinstance(text, str) or _FORM.fullmatch(text) is None:
                raise ValueError("another form")
            values[row] = _seconds(_COLON.sub(r"\1.\2", text.strip().replace(",", ".")))
        except ValueError as error:
            raise _no_time(table, name, row) from error
    return _unwrapped(values, SECONDS_PER_DAY) if str(texts[0]).strip()[4:5] != "-" else values


def _no_time(table: Table, name: str, row: int) -> InputError:
    return InputError(
        f"found {str(table.columns[name][row])[:40]!r}",
        file=table.path,
        column=name,
        row=table.line(row),
        allowed="a time such as 2024-05-03T12:34:56.789 in all rows, or seconds in all rows",
        remedy="correct or remove the row",
    )


def _unwrapped(values: Array, period: float) -> Array:
    """Adds a day or an hour wherever a clock without dates begins again."""
    again = np.concatenate([[False], np.diff(values) < -0.5 * period])
    return values + period * np.cumsum(again)


def _sheet_parts(text: str) -> re.Match[str] | None:
    """The parts of a time as a spreadsheet writes it; hours and minutes alone could be something else."""
    match = _SHEET.fullmatch(text)
    if match is None or (match["seconds"] is None and match["date"] is None):
        return _MINUTES.fullmatch(text)
    return match


def _of_sheet(table: Table, name: str) -> Array:
    texts = table.columns[name]
    hours = np.empty(len(texts))
    dates: list[tuple[int, ...]] = []
    mark, period = "", SECONDS_PER_DAY
    for row, text in enumerate(texts):
        match = _sheet_parts(text) if isinstance(text, str) else None
        if match is None:
            raise _no_time(table, name, row)
        parts = match.groupdict()
        hour = int(parts.get("hours") or 0)
        half = (parts.get("half") or "").lower()[:1]
        if half:
            hour = hour % 12 + 12 * (half == "p")
        seconds = float((parts["seconds"] or "0").replace(",", "."))
        hours[row] = SECONDS_PER_HOUR * hour + 60.0 * int(parts["minutes"]) + seconds
        period = SECONDS_PER_DAY if "hours" in parts else SECONDS_PER_HOUR
        if parts.get("date"):
            mark = parts["mark"]
            dates.append(tuple(int(number) for number in parts["date"].split(mark)))
        if dates and len(dates) != row + 1:
            raise _no_time(table, name, row)
    if not dates:
        return _unwrapped(hours, period)
    orders = ("dmy",) if mark == "." else ("mdy", "dmy")
    if dates[0][0] > 31:
        orders = ("ymd",)
    found = [hours + days for order in orders if (days := _days(dates, order)) is not None]
    if not found:
        raise _no_time(table, name, 0)
    return min(found, key=lambda values: float(values.max() - values.min()))


def _days(dates: list[tuple[int, ...]], order: str) -> Array | None:
    """Seconds since 1970 at the beginning of each date; None if one does not exist in this order."""
    known: dict[tuple[int, ...], float] = {}
    for date in dict.fromkeys(dates):
        part = dict(zip(order, date, strict=True))
        year = part["y"] + 2000 * (part["y"] < 100)
        try:
            known[date] = datetime(year, part["m"], part["d"], tzinfo=UTC).timestamp()
        except ValueError:
            return None
    return np.array([known[date] for date in dates])


def _by_numpy(texts: NDArray[Any]) -> Array | None:
    """The fast way, for dates without a zone; None for other forms."""
    first = str(texts[0])
    if (
        _FORM.fullmatch(first) is None
        or first[4:5] != "-"
        or re.search(r"(Z|[+-]\d{2}:?\d{2})\s*$", first[11:])
        or "," in first
    ):
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
