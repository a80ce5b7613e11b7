import math
import os

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from robots.common.errors import InputError
from robots.common.tables.table_files import Table, read_table, write_table

SUFFIXES = (".csv", ".parquet")
SHARED_FOLDER = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=60)


def refused(path, **kwargs):
    with pytest.raises(InputError) as caught:
        read_table(path, **kwargs)
    assert caught.value.file == str(path)
    return caught.value


@pytest.mark.slow
@pytest.mark.parametrize("suffix", SUFFIXES)
@SHARED_FOLDER
@given(values=arrays(np.float64, st.tuples(st.integers(1, 30), st.integers(1, 4))))
@example(values=np.array([[5e-324, -0.0, 1.7976931348623157e308, 2.2250738585072014e-308]]))
@example(values=np.array([[0.1 + 0.2, math.pi, np.inf, np.nan]]))
def test_numbers_read_back_bit_by_bit(tmp_path, suffix, values):
    """Every float64, with signed zeros, subnormal and infinite ones, reads back exactly; NaN as NaN."""
    path = tmp_path / f"table{suffix}"
    columns = {f"c{index}": values[:, index] for index in range(values.shape[1])}
    write_table(path, columns, force=True)
    table = read_table(path)
    assert table.names == tuple(columns)
    for name, column in columns.items():
        read = table.columns[name]
        assert read.dtype == np.float64
        np.testing.assert_array_equal(read, column)
        numbers = ~np.isnan(column)
        assert np.array_equal(np.signbit(read[numbers]), np.signbit(column[numbers]))


plain_values = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**53), 2**53) | st.floats(allow_nan=False) | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=6,
)


@pytest.mark.slow
@pytest.mark.parametrize("suffix", SUFFIXES)
@SHARED_FOLDER
@given(metadata=st.dictionaries(st.text(), plain_values, max_size=4))
def test_metadata_reads_back(tmp_path, suffix, metadata):
    """Any metadata of text, numbers, lists and mappings reads back, whatever line ends its text holds."""
    path = tmp_path / f"table{suffix}"
    write_table(path, {"x": [1.0]}, metadata, force=True)
    assert read_table(path).metadata == metadata


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_units_text_and_numpy_metadata_read_back(tmp_path, suffix):
    """Units read back by column, text stays text even where it looks like a number, numpy metadata becomes plain."""
    path = tmp_path / f"table{suffix}"
    write_table(
        path,
        {"joint": ["1", "2", ""], "note": ["a,b", 'say "x"', "nan"], "q": [1, 2, 3], "on": [True, False, True]},
        {"seed": np.int64(3), "limits": np.array([1.5, 2.0]), "names": ("a", "b"), "path": path},
        units={"q": "rad"},
    )
    table = read_table(path)
    assert isinstance(table, Table)
    assert list(table.columns["joint"]) == ["1", "2", ""]
    assert list(table.columns["note"]) == ["a,b", 'say "x"', "nan"]
    assert table.is_text("note")
    assert not table.is_text("q")
    assert table.columns["on"].tolist() == [1.0, 0.0, 1.0]
    assert table.units == {"q": "rad"}
    assert table.metadata == {"seed": 3, "limits": [1.5, 2.0], "names": ["a", "b"], "path": str(path)}
    assert len(table) == 3


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_columns_that_are_not_wanted_may_hold_anything(tmp_path, suffix):
    """Columns that were not asked for are named and not looked at."""
    path = tmp_path / f"table{suffix}"
    if suffix == ".csv":
        path.write_text("a,t,note\n1,0,x\nb,1,\n,2,3\n")
    else:
        pq.write_table(pa.table({"a": [b"1", None, b"x"], "t": [0.0, 1.0, 2.0], "note": [[1], [], None]}), path)
    table = read_table(path, wanted=lambda name: name == "t")
    assert table.columns["t"].tolist() == [0.0, 1.0, 2.0]
    assert (table.names, table.skipped) == (("t",), ("a", "note"))


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_table_of_no_wanted_column_is_empty(tmp_path, suffix):
    """If no column is wanted, the table says so by its names."""
    path = tmp_path / f"table{suffix}"
    write_table(path, {"a": [1.0]})
    table = read_table(path, wanted=lambda name: False)
    assert (table.names, table.skipped, len(table)) == ((), ("a",), 0)


@pytest.mark.parametrize("name", ["table.xlsx", "table", "table.csv.gz", "table.txt"])
def test_other_suffixes_are_refused(tmp_path, name):
    """A file of another type is an input error that names the allowed types, for reading and writing."""
    (tmp_path / name).write_text("t\n1\n")
    assert ".csv or .parquet" in str(refused(tmp_path / name))
    with pytest.raises(InputError, match=r"\.csv or \.parquet"):
        write_table(tmp_path / name, {"t": [1.0]}, force=True)


@pytest.mark.parametrize("name", ["none.csv", "none.parquet"])
def test_missing_file_and_folder_are_refused(tmp_path, name):
    """A missing file and a folder of the name of a table are input errors."""
    assert "no such file" in str(refused(tmp_path / name))
    (tmp_path / name).mkdir()
    assert "a folder" in str(refused(tmp_path / name))


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize(
    ("columns", "word"),
    [
        ({}, "no columns"),
        ({"a": []}, "shape"),
        ({"a": [[1.0]]}, "shape"),
        ({"a": 1.0}, "shape"),
        ({"a": [1.0], "b": [1.0, 2.0]}, "2 rows, but column a has 1"),
        ({"": [1.0]}, "cannot name"),
        ({" a": [1.0]}, "cannot name"),
        ({"a,b": [1.0]}, "cannot name"),
        ({"#a": [1.0]}, "cannot name"),
        ({"a\nb": [1.0]}, "cannot name"),
        ({"a b": [1.0]}, "only column"),
        ({"1": [1.0], "nan": [1.0]}, "all numbers"),
        ({"a": [1.0, None]}, "found 1.0"),
        ({"a": ["x\ny"]}, "found"),
        ({"a": ["\ud800"]}, "cannot be written"),
        ({"a": [1j]}, "found"),
    ],
)
def test_what_is_no_table_is_not_written(tmp_path, suffix, columns, word):
    """Columns that could not be read back are input errors, and no file appears."""
    with pytest.raises(InputError, match=word):
        write_table(tmp_path / f"table{suffix}", columns)
    assert os.listdir(tmp_path) == []


def test_unit_of_no_column_is_refused(tmp_path):
    """A unit for a column that is not there is an input error."""
    with pytest.raises(InputError) as caught:
        write_table(tmp_path / "table.csv", {"a": [1.0]}, units={"b": "s"})
    assert caught.value.column == "b"


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_existing_table_is_replaced_with_force_only(tmp_path, suffix):
    """A table is not overwritten without force."""
    path = tmp_path / f"table{suffix}"
    write_table(path, {"a": [1.0]})
    with pytest.raises(InputError, match="force"):
        write_table(path, {"a": [2.0]})
    assert read_table(path).columns["a"].tolist() == [1.0]
    write_table(path, {"a": [2.0]}, force=True)
    assert read_table(path).columns["a"].tolist() == [2.0]


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_disk_that_fills_up_is_an_input_error(tmp_path, monkeypatch, suffix):
    """What the operating system refuses while the table is written is an input error, and no file appears."""

    def refuse(*args, **kwargs):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("robots.common.tables.csv_tables.pa_csv.write_csv", refuse)
    monkeypatch.setattr("robots.common.tables.table_files.pq.write_table", refuse)
    with pytest.raises(InputError, match="No space left"):
        write_table(tmp_path / f"table{suffix}", {"a": [1.0]})
    assert os.listdir(tmp_path) == []
