import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from robots.common.errors import InputError
from robots.common.tables.table_files import read_table, write_table


def refused(path, **kwargs):
    with pytest.raises(InputError) as caught:
        read_table(path, **kwargs)
    assert caught.value.file == str(path)
    return caught.value


@pytest.mark.parametrize("content", [b"", b"PAR1", b"t,q1\n0,1\n", b"PAR1" + b"\0" * 100 + b"PAR1"])
def test_broken_parquet_file_is_refused(tmp_path, content):
    """An empty, foreign or damaged Parquet file is an input error."""
    path = tmp_path / "table.parquet"
    path.write_bytes(content)
    refused(path)


def test_parquet_file_cut_short_or_damaged_is_refused(tmp_path):
    """A Parquet file that lost its end, or bytes in its pages, never gives a traceback of its library."""
    path = tmp_path / "table.parquet"
    write_table(path, {"x": np.random.default_rng(0).normal(size=1000)})
    whole = path.read_bytes()
    path.write_bytes(whole[:-10])
    refused(path)
    path.write_bytes(whole[:4] + b"\xff" * 60 + whole[64:])
    refused(path)


def test_parquet_columns_of_other_types(tmp_path):
    """Numbers of any type become float64 with NaN for null, categories become text, other types are refused."""
    path = tmp_path / "table.parquet"
    content = {
        "i": pa.array([1, None, 3], pa.int32()),
        "f": pa.array([1.5, None, 2.5], pa.float32()),
        "h": pa.array(np.array([1.5, 2.0, 2.5], np.float16)),
        "b": pa.array([True, False, None]),
        "z": pa.nulls(3),
        "s": pa.array(["a", None, "c"]),
        "c": pa.array(["a", "b", "a"]).dictionary_encode(),
    }
    pq.write_table(pa.table(content), path, row_group_size=2)
    table = read_table(path)
    np.testing.assert_array_equal(table.columns["i"], [1, np.nan, 3])
    np.testing.assert_array_equal(table.columns["f"], [1.5, np.nan, 2.5])
    np.testing.assert_array_equal(table.columns["h"], [1.5, 2.0, 2.5])
    np.testing.assert_array_equal(table.columns["b"], [1, 0, np.nan])
    assert np.isnan(table.columns["z"]).all()
    assert list(table.columns["s"]) == ["a", "", "c"]
    assert list(table.columns["c"]) == ["a", "b", "a"]
    assert {column.dtype for column in table.columns.values()} == {np.dtype(float), np.dtype(object)}
    assert table.first_row == 1
    pq.write_table(pa.table({"t": pa.array([b"a", b"b"], pa.binary())}), path)
    assert refused(path).column == "t"


def test_parquet_stamps_of_time_are_seconds(tmp_path):
    """A column of time stamps is read in seconds, with more digits than a float of nanoseconds would have."""
    path = tmp_path / "table.parquet"
    pq.write_table(pa.table({"t": pa.array([1_714_739_696_789_123_456, None], pa.timestamp("ns"))}), path)
    times = read_table(path).columns["t"]
    assert abs(times[0] - 1_714_739_696.789123456) < 3e-7  # the spacing of floats there
    assert np.isnan(times[1])


def test_parquet_without_rows_or_with_a_duplicate_is_refused(tmp_path):
    """A table without rows and one with a column twice are input errors."""
    path = tmp_path / "table.parquet"
    pq.write_table(pa.table({"t": pa.array([], pa.float64())}), path)
    assert "no rows" in str(refused(path))
    pq.write_table(pa.Table.from_arrays([pa.array([1.0]), pa.array([2.0])], names=["t", "t"]), path)
    assert refused(path).column == "t"


@pytest.mark.parametrize("stored", [b"{}", b"no json", b'{"meta": 3, "units": {}}'])
def test_parquet_of_other_writers_gives_its_key_value_pairs(tmp_path, stored):
    """Metadata of a foreign Parquet file are its text pairs, without those of pandas."""
    path = tmp_path / "table.parquet"
    pd.DataFrame({"t": [1.0]}).to_parquet(path)
    content = pq.read_table(path)
    pq.write_table(content.replace_schema_metadata({**content.schema.metadata, "units": "deg", "table": stored}), path)
    assert read_table(path).metadata == {"units": "deg"}


def test_parquet_column_is_not_copied(tmp_path):
    """A float64 column of one row group without nulls is a view of the library's memory."""
    path = tmp_path / "table.parquet"
    write_table(path, {"x": np.arange(1000.0)})
    assert not read_table(path).columns["x"].flags.owndata
