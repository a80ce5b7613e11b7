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


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("03.05.2024 12:34:56,789", "03.05.2024 12:34:57,789"),
        ("3.5.24 12:34:56,789", "3.5.24 12:34:57,789"),
        ("5/3/2024 12:34:56.789 PM", "5/3/2024 12:34:57.789 pm"),
        ("5/3/2024 12:34:56.789", "5/3/2024 12:34:57.789"),
        ("2024/05/03 12:34:56.789", "2024/05/03 12:34:57.789"),
        ("2024-5-3 12:34:56.789", "2024-5-3 12:34:57.789"),
    ],
)
def test_dates_of_spreadsheets_are_seconds_since_1970(tmp_path, first, second):
    """Day or year first, with points, strokes or halves of the day: the moment that Python's clock gives."""
    moment = datetime(2024, 5, 3, 12, 34, 56, 789000, tzinfo=UTC).timestamp()
    found = seconds_of(table(tmp_path, first, second), "t")
    np.testing.assert_allclose(found, [moment, moment + 1.0], rtol=0, atol=3e-7)


def test_the_order_of_day_and_month_is_that_of_the_whole_column(tmp_path):
    """A log over midnight takes a second and not a month; a first number of 13 is a day."""
    for cells in (("1/2/2024 23:59:59", "2/2/2024 0:00:00"), ("13/2/2024 23:59:59", "14/2/2024 0:00:00")):
        found = seconds_of(table(tmp_path, *cells), "t")
        day = int(cells[1].split("/")[0])
        np.testing.assert_allclose(found[1], datetime(2024, 2, day, tzinfo=UTC).timestamp(), rtol=0, atol=3e-7)
        assert found[1] - found[0] == 1.0


@pytest.mark.parametrize(
    ("cells", "seconds"),
    [
        (("34:56.7", "34:56.9", "35:00.0"), (2096.7, 2096.9, 2100.0)),
        (("59:59.5", "00:00.5"), (3599.5, 3600.5)),
        (("23:59:59.5", "00:00:00.5"), (86399.5, 86400.5)),
        (("9:00:00", "9:00:01"), (32400.0, 32401.0)),
        (("11:59:59 AM", "12:00:00 PM", "1:00:00 PM"), (43199.0, 43200.0, 46800.0)),
    ],
)
def test_times_without_a_date_go_on(tmp_path, cells, seconds):
    """Minutes and seconds go on after the full hour, hours after midnight."""
    np.testing.assert_allclose(seconds_of(table(tmp_path, *cells), "t"), seconds, rtol=0, atol=1e-9)


@pytest.mark.parametrize("cell", ["32.05.2024 12:00:00", "1/2/2024 12:00:00,x", "12:00:00"])
def test_a_date_that_is_none_is_named(tmp_path, cell):
    """A date that does not exist, and a time without a date among dates, name column and row."""
    with pytest.raises(InputError) as caught:
        seconds_of(table(tmp_path, "1.5.2024 12:00:00", cell), "t")
    assert caught.value.column == "t"
