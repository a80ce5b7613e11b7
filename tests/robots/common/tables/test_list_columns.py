"""Columns of lists in Parquet files."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from robots.common.errors import InputError
from robots.common.tables.table_files import parquet_names, read_parquet

VALUES = np.arange(12.0).reshape(4, 3)


def written(tmp_path, kind, rows=None):
    rows = VALUES.tolist() if rows is None else rows
    table = pa.table({"t": [0.0, 1.0, 2.0, 3.0], "a.q": pa.array(rows, type=kind), "text": [["x"]] * 4})
    pq.write_table(table, tmp_path / "table.parquet")
    return tmp_path / "table.parquet"


@pytest.mark.parametrize(
    "kind", [pa.list_(pa.float32(), 3), pa.list_(pa.float64()), pa.large_list(pa.float64()), pa.list_(pa.int32())]
)
def test_a_list_is_as_many_columns_as_it_is_long(tmp_path, kind):
    """Fixed or variable, of any numbers: column k is number k of each list, and others are not read."""
    path = written(tmp_path, kind)
    assert parquet_names(path) == ["t", "a.q1", "a.q2", "a.q3", "text"]
    table = read_parquet(path, lambda name: name in ("t", "a.q1", "a.q3"))
    np.testing.assert_array_equal(table.columns["a.q1"], VALUES[:, 0])
    np.testing.assert_array_equal(table.columns["a.q3"], VALUES[:, 2])
    assert table.skipped == ("a.q2", "text")


def test_a_missing_list_is_a_gap(tmp_path):
    """A row without a list has no number in its columns."""
    table = read_parquet(
        written(tmp_path, pa.list_(pa.float64()), [*VALUES[:2].tolist(), None, [1.0, 2.0, 3.0]]),
        lambda name: name != "text",
    )
    np.testing.assert_array_equal(table.columns["a.q2"], [1.0, 4.0, np.nan, 2.0])


def test_lists_of_several_lengths_are_refused(tmp_path):
    """They are not one number a joint; nothing is said of a column that is not read."""
    path = written(tmp_path, pa.list_(pa.float64()), [*VALUES[:3].tolist(), [1.0, 2.0]])
    with pytest.raises(InputError, match="lists of 2 to 3 numbers") as caught:
        read_parquet(path, lambda name: name == "a.q1")
    assert caught.value.column == "a.q1"
    assert list(read_parquet(path, lambda name: name == "t").columns) == ["t"]


def test_a_list_of_one_number_is_that_number(tmp_path):
    """It has the column's name, or that of the first joint if that is wanted."""
    pq.write_table(pa.table({"q": [[1.0], [2.0]]}), tmp_path / "table.parquet")
    for name in ("q", "q1"):
        table = read_parquet(tmp_path / "table.parquet", lambda found, name=name: found == name)
        assert table.columns[name].tolist() == [1.0, 2.0]
