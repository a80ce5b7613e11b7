import math
import os
import time

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import yaml
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from robots.common.errors import InputError
from robots.common.tables import Table, read_table, write_table

SUFFIXES = (".csv", ".parquet")
SHARED_FOLDER = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=60)


def csv(tmp_path, content):
    path = tmp_path / "table.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def refused(path, **kwargs):
    with pytest.raises(InputError) as caught:
        read_table(path, **kwargs)
    assert caught.value.file == str(path)
    return caught.value


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


@SHARED_FOLDER
@given(values=arrays(np.float64, st.integers(1, 30), elements=st.floats(-1e300, 1e300, allow_subnormal=False)))
def test_pandas_reads_the_csv_file(tmp_path, values):
    """A pandas user reads a written CSV file with comment="#"; its parser may round the last digit."""
    path = tmp_path / "table.csv"
    write_table(path, {"t": np.arange(len(values)), "x": values}, {"robot": "er3a"}, units={"x": "rad"}, force=True)
    frame = pd.read_csv(path, comment="#")
    np.testing.assert_allclose(frame["x"].to_numpy(dtype=float), values, rtol=1e-14)
    assert list(frame.columns) == ["t", "x"]


plain_values = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**53), 2**53) | st.floats(allow_nan=False) | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=6,
)


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


def test_block_follows_the_ecsv_standard(tmp_path):
    """The head is the ECSV mark, a document mark, then YAML with delimiter, datatype and meta; then the header."""
    path = tmp_path / "table.csv"
    write_table(path, {"t": [0.0, 0.5], "k": [1, 2]}, {"robot": "er3a"}, units={"t": "s"})
    lines = path.read_text().splitlines()
    assert lines[:4] == ["# %ECSV 1.0", "# ---", "# delimiter: ','", "# datatype:"]
    block = yaml.safe_load("\n".join(line[2:] for line in lines if line.startswith("#"))[len("%ECSV 1.0\n") :])
    assert block == {
        "delimiter": ",",
        "datatype": [{"name": "t", "unit": "s", "datatype": "float64"}, {"name": "k", "datatype": "int64"}],
        "meta": {"robot": "er3a"},
    }
    assert [line for line in lines if not line.startswith("#")] == ["t,k", "0,1", "0.5,2"]


def test_ordered_map_of_other_writers_is_understood(tmp_path):
    """The standard's ordered map (!!omap) reads as metadata."""
    head = "# %ECSV 1.0\n# ---\n# delimiter: ','\n# datatype:\n# - {name: t, datatype: float64}\n"
    table = read_table(csv(tmp_path, head + "# meta: !!omap\n# - {robot: er3a}\n# - {period: 0.004}\nt\n1\n"))
    assert table.metadata == {"robot": "er3a", "period": 0.004}


@pytest.mark.parametrize(
    ("block", "metadata"),
    [
        ("# units: deg\n# robot: er3a\n", {"units": "deg", "robot": "er3a"}),
        ("#units:deg\n#period = 0.004\n", {"units": "deg", "period": 0.004}),
        ("# made by Bob: at noon: 12\n# units: deg\n# tested\n", {"units": "deg"}),
        ("# {units: {q: deg}}\n", {"units": {"q": "deg"}}),
        ("# day: 2024-13-45\n", {"day": "2024-13-45"}),
        ("# just words\n#\n", {}),
        ("\n# units: rad\n\n", {"units": "rad"}),
    ],
)
def test_plain_block_states_keys(tmp_path, block, metadata):
    """A block without the ECSV mark is YAML, or lines of keys among remarks."""
    table = read_table(csv(tmp_path, block + "t,q1\n0,1\n"))
    assert table.metadata == metadata
    assert table.line(0) == block.count("\n") + 2


@pytest.mark.parametrize(
    ("block", "word"),
    [
        ("# %ECSV 1.0\n# ---\n# a: [1\n", "not valid YAML"),
        ("# %ECSV 1.0\n# ---\n# day: 2024-13-45\n", "not valid YAML"),
        ("# %ECSV 1.0\n# ---\n# words\n", "no keys"),
        ("# %ECSV 1.0\n# ---\n# datatype: []\n", "delimiter ' '"),
        ("# %ECSV 1.0\n# delimiter: ','\n# datatype: 3\n", "datatype"),
        ("# %ECSV 1.0\n# delimiter: ','\n# meta: 3\n", "meta"),
    ],
)
def test_broken_ecsv_block_is_refused(tmp_path, block, word):
    """A block that claims to be ECSV and is not is an input error."""
    assert word in str(refused(csv(tmp_path, block + "t,q1\n0,1\n")))


@pytest.mark.parametrize(
    "content",
    [
        "t,q1\n0,1\n1,2\n",
        "t,q1\r\n0,1\r\n1,2\r\n",
        "t,q1\n0,1\n1,2",
        "t,q1\n0,1\n1,2\n\n\r\n\n",
        "\ufefft,q1\n0,1\n1,2\n",
        ' t , q1 \n 0 ,"1"\n+1.0,2e0\n',
        '"t","q1"\n0,1.\n1,.2e1\n',
    ],
)
def test_harmless_variants_are_read(tmp_path, content):
    """Byte order mark, CR LF, quotes, spaces, a missing or repeated last line end change nothing."""
    table = read_table(csv(tmp_path, content))
    assert table.first_row == 2
    assert {name: column.tolist() for name, column in table.columns.items()} == {"t": [0.0, 1.0], "q1": [1.0, 2.0]}


def test_empty_cells_and_their_spellings_are_nan(tmp_path):
    """An empty cell in a column of numbers, or one of its spellings, reads as NaN."""
    table = read_table(csv(tmp_path, "t,x\n0,\n1,nan\n2,NA\n3,null\n4,NaN\n5,-Infinity\n"))
    np.testing.assert_array_equal(table.columns["x"], [np.nan] * 5 + [-np.inf])


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"", {"problem": "empty"}),
        (b"\n\n", {"problem": "no header"}),
        (b"# units: rad\n", {"problem": "no header"}),
        (b"t,q1\n", {"problem": "no rows", "row": 1}),
        (b"# a\nt,q1\n\n\n", {"problem": "no rows", "row": 2}),
        (b"0,1\n1,2\n", {"problem": "no header", "row": 1}),
        (b"# a\n0,1\n1,2\n", {"problem": "no header", "row": 2}),
        (b"t,q1,q1\n0,1,2\n", {"problem": "twice", "column": "q1", "row": 1}),
        (b"# a\nt,,q1\n0,1,2\n", {"problem": "number 2 has no name", "row": 2}),
        (b"t,q1\n0,1\n1\n", {"problem": "1 cells", "row": 3}),
        (b"# a\nt,q1\n0,1\n1,2,3\n2,3\n", {"problem": "3 cells", "row": 4}),
        (b"t,q1\n0,1,2\n", {"problem": "3 cells", "row": 2}),
        (b"t,q1\n0,1\n1,2\n2", {"problem": "1 cells", "row": 4}),
        (b"t,q1\n0,1\n1,abc\n2,d\n", {"problem": "'abc'", "column": "q1", "row": 3}),
        (b"t,q1\nx,1\n1,2\n", {"problem": "'x'", "column": "t", "row": 2}),
        (b"t,q1\n0,1\n1,1.2.3\n", {"problem": "'1.2.3'", "column": "q1", "row": 3}),
        (b"t,q1\n0,1\n1,0x10\n", {"problem": "'0x10'", "column": "q1", "row": 3}),
        (b"t,q1\n0,1\n\n1,2\n", {"problem": "empty line", "row": 3}),
        (b"t,q1\r\n0,1\r\n  \r\n1,2\r\n", {"problem": "empty line", "row": 3}),
        (b"t,q1\n\n0,1\n", {"problem": "empty line", "row": 2}),
        (b"t,q1\n0,1\n# pause\n1,2\n", {"problem": "comment line", "row": 3}),
        (b"t;q1\n0;1\n", {"problem": "semicolons", "row": 1}),
        (b"t;q1\n0,5;1,5\n", {"problem": "semicolons", "row": 1}),
        (b"t\tq1\n0\t1\n", {"problem": "tabs", "row": 1}),
        (b"t q1\n0 1\n", {"problem": "spaces", "row": 1}),
        (b"t,q1\n0,1\n1,\0\n", {"problem": "zero byte", "row": 3}),
        (b"t,q1\n" + b"\0" * 4096, {"problem": "zero byte", "row": 2}),
        ("t,q1\n0,1\n".encode("utf-16"), {"problem": "UTF-16"}),
        ("t,q1\n0,1\n".encode("utf-16-be"), {"problem": "zero byte", "row": 1}),
        ("# 20 °C\nt,q1\n0,1\n".encode("latin-1"), {"problem": "not UTF-8", "row": 1}),
        ("t,°\n0,1\n".encode("latin-1"), {"problem": "not UTF-8", "row": 1}),
        ("t,q1\n°,1\n".encode("latin-1"), {"problem": "not UTF-8", "row": 2}),
        ("t,q1\n0,1\n1,°\n".encode("latin-1"), {"problem": "not UTF-8", "row": 3}),
        ("t,note\n0,a\n1,°\n".encode("latin-1"), {"problem": "not UTF-8", "row": 3}),
        (b"t,q1\r0,1\r1,2\r", {"problem": "carriage return", "row": 1}),
        (b"t,q1\n0,1\r1,2\n", {"problem": "carriage return", "row": 2}),
        (b't,q1\n0,"1\n1,2\n', {"problem": "not a CSV file"}),
        (b"t," + b"x" * 200_000 + b"\n0,1\n", {"problem": "no header", "row": 1}),
        (b"t,q1\n0," + b"1" * 200_000 + b"\n", {"problem": "not a line of a CSV", "row": 2}),
        (b"t,note\n0,start\n1,2\n", {"problem": "'start'", "column": "note", "row": 2}),
    ],
)
def test_broken_csv_file_is_refused_with_place(tmp_path, content, expected):
    """Whatever is wrong with a CSV file is an input error with its column and line, and no traceback of the parser."""
    error = refused(csv(tmp_path, content))
    assert expected["problem"] in error.problem
    assert (error.column, error.row) == (expected.get("column"), expected.get("row"))


def test_cause_of_a_refused_cell_is_kept(tmp_path):
    """The parser's own error stays attached to ours."""
    assert isinstance(refused(csv(tmp_path, "t,q1\n0,1\n1,abc\n")).__cause__, pa.ArrowException)


def test_fault_deep_in_a_long_file_has_its_line(tmp_path):
    """A bad cell beyond the first blocks of the parser is found with its line."""
    rows = [f"{index},{index * 0.1!r},{'0.123456789' * 3}" for index in range(600_000)]
    rows[550_000] = "550000,oops,1"
    error = refused(
        csv(tmp_path, "# a\nt,q1,q2\n" + "\n".join(r.replace("0.1234567890.1234567890", "0.1") for r in rows))
    )
    assert (error.column, error.row) == ("q1", 550_003)


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
    pq.write_table(pa.table({"t": pa.array([0, 1], pa.timestamp("ms"))}), path)
    assert refused(path).column == "t"


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


def test_trajectory_is_written_fast(tmp_path):
    """20,000 rows of 19 columns are written well within a second (0.04 s; the bound allows for a busy machine)."""
    values = np.random.default_rng(0).normal(size=(20_000, 19))
    start = time.perf_counter()
    write_table(tmp_path / "table.csv", {f"c{index}": values[:, index] for index in range(19)})
    assert time.perf_counter() - start < 1.0


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_disk_that_fills_up_is_an_input_error(tmp_path, monkeypatch, suffix):
    """What the operating system refuses while the table is written is an input error, and no file appears."""

    def refuse(*args, **kwargs):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("robots.common.csv_tables.pa_csv.write_csv", refuse)
    monkeypatch.setattr("robots.common.tables.pq.write_table", refuse)
    with pytest.raises(InputError, match="No space left"):
        write_table(tmp_path / f"table{suffix}", {"a": [1.0]})
    assert os.listdir(tmp_path) == []
