"""Times of ISO 8601 in seconds."""

from datetime import UTC, datetime, timedelta, timezone

import numpy as np
import pytest

from robots.common.errors import InputError
from robots.common.tables.table_files import read_table
from robots.common.tables.times import is_time, seconds_of

MOMENT = datetime(2024, 5, 3, 12, 34, 56, 789123, tzinfo=UTC)
SECONDS = MOMENT.timestamp()


def table(tmp_path, *cells):
    path = tmp_path / "table.csv"
    path.write_text("t;x\n" + "".join(f"{cell};1\n" for cell in cells))
    return read_table(path)


@pytest.mark.parametrize(
    "text",
    [
        "2024-05-03T12:34:56.789123",
        "2024-05-03 12:34:56,789123",
        "2024-05-03T12:34:56.789123Z",
        "2024-05-03T12:34:56.789123000",
        MOMENT.astimezone(timezone(timedelta(hours=2))).isoformat(),
        "2024-05-03T14:34:56.789123+0200",
    ],
)
def test_dates_are_seconds_since_1970(tmp_path, text):
    """Blank or T, point or comma, with a zone or without: the same moment, by Python's own clock."""
    # A float near 1.7e9 has a spacing of 2.4e-7.
    np.testing.assert_allclose(seconds_of(table(tmp_path, text, text), "t"), [SECONDS, SECONDS], rtol=0, atol=3e-7)


def test_times_of_a_day_are_seconds_since_midnight(tmp_path):
    """Without a date, a time counts from midnight."""
    found = seconds_of(table(tmp_path, "00:00:01.5", "01:01:02"), "t")
    np.testing.assert_array_equal(found, [1.5, 3662.0])


@pytest.mark.parametrize(("cell", "row"), [("start", 3), ("2024-13-03T12:34:56", 3), ("", 3)])
def test_other_cells_are_named(tmp_path, cell, row):
    """A cell that is no time is named with its line."""
    with pytest.raises(InputError) as caught:
        seconds_of(table(tmp_path, "2024-05-03T12:34:56", cell), "t")
    assert (caught.value.column, caught.value.row) == ("t", row)


@pytest.mark.parametrize("text", ["12", "2024-05-03", "noon", "12:34", 5.0, None])
def test_numbers_and_dates_alone_are_no_times(text):
    """What could be something else is left as it is."""
    assert not is_time(text)
