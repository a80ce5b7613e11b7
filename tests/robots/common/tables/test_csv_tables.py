import time

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from robots.common.errors import InputError
from robots.common.tables.csv_tables import csv_names
from robots.common.tables.table_files import read_table, write_table

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


@pytest.mark.slow
@SHARED_FOLDER
@given(values=arrays(np.float64, st.integers(1, 30), elements=st.floats(-1e300, 1e300, allow_subnormal=False)))
def test_pandas_reads_the_csv_file(tmp_path, values):
    """A pandas user reads a written CSV file with comment="#"; its parser may round the last digit."""
    path = tmp_path / "table.csv"
    write_table(path, {"t": np.arange(len(values)), "x": values}, {"robot": "er3a"}, units={"x": "rad"}, force=True)
    frame = pd.read_csv(path, comment="#")
    np.testing.assert_allclose(frame["x"].to_numpy(dtype=float), values, rtol=1e-14)
    assert list(frame.columns) == ["t", "x"]


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


@pytest.mark.parametrize(
    ("content", "first_row"),
    [
        ("# t,q1\n0,1\n1,2\n", 2),
        ("# made today\n# t, q1\n0,1\n1,2\n", 3),
        ("# t q1\n0 1\n1 2\n", 2),
        ("# t q1\n0,1\n1,2\n", 2),
        ("sep=;\nt;q1\n0;1\n1;2\n", 3),
        ("sep=,\r\nt,q1\r\n0,1\r\n1,2\r\n", 3),
        ("t,q1,\n0,1,\n1,2,\n", 2),
        ("t,q1,\n0,1\n1,2\n", 2),
        ("t,q1\n0,1,\n1,2,\n", 2),
        ("t;q1;\n0;1,0;\n1;2,0;\n", 2),
        (",t,q1\n0,0,1\n1,1,2\n", 2),
        ("t q1\n0 1\n1 2\n", 2),
        ("  t    q1\n  0.0  1e0 \r\n 1.0\t2\n", 2),
        ('t,q1\n"0,0","1,0"\n"1,0","2,0"\n', 2),
    ],
)
def test_dialects_of_other_programs_are_read(tmp_path, content, first_row):
    """Names behind #, sep=, delimiters at the ends of lines, row numbers without a name, and blanks are understood."""
    table = read_table(csv(tmp_path, content))
    assert table.first_row == first_row
    assert {name: column.tolist() for name, column in table.columns.items()} == {"t": [0.0, 1.0], "q1": [1.0, 2.0]}
    assert table.skipped == ()


def test_numpy_savetxt_with_a_header_is_read(tmp_path):
    """What numpy writes reads back to the last bit, the block above the names included."""
    values = np.random.default_rng(1).normal(size=(5, 3))
    np.savetxt(tmp_path / "table.csv", values, header="robot: arm\nt q1 tau1")
    table = read_table(tmp_path / "table.csv")
    assert (table.metadata, table.first_row) == ({"robot": "arm"}, 3)
    np.testing.assert_array_equal(np.column_stack([table.columns[name] for name in ("t", "q1", "tau1")]), values)


def test_names_that_appear_twice_matter_only_where_they_are_wanted(tmp_path):
    """A log with commands beside states may name a column twice."""
    path = csv(tmp_path, "t,q_d,q_d\n0,1,2\n1,2,3\n")
    assert read_table(path, wanted=lambda name: name == "t").skipped == ("q_d", "q_d (2)")
    assert refused(path, wanted=lambda name: name == "q_d").column == "q_d"
    assert csv_names(path) == ["t", "q_d", "q_d (2)"]


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
        (b"t;q1\n0,5;1,5\n1.5;2\n", {"problem": "decimal commas (line 2)", "row": 3}),
        (b"t;q1\n0;1\n1,2\n", {"problem": "1 cells", "row": 3}),
        (b"t,q1\n0;1\n", {"problem": "1 cells", "row": 2}),
        (b"t;q1\n0;1\n1;1.234.567,8\n", {"problem": "'1.234.567,8'", "column": "q1", "row": 3}),
        (b"t q1\n0,1\n", {"problem": "spaces", "row": 1}),
        (b"t q1\n0 1\n1\n", {"problem": "1 cells", "row": 3}),
        (b"t q1\n0 1\n1  x\n", {"problem": "'x'", "column": "q1", "row": 3}),
        (b"# t,q1\n0,1\n1,x\n", {"problem": "'x'", "column": "q1", "row": 3}),
        (b"# t,q1,q2\n0,1\n", {"problem": "no header", "row": 2}),
        (b"sep=;\nt;q1\n0;1\n1;x\n", {"problem": "'x'", "column": "q1", "row": 4}),
        (b"t,q1,\n0,1,2\n", {"problem": "number 3 has no name", "row": 1}),
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


@pytest.mark.slow
def test_fault_deep_in_a_long_file_has_its_line(tmp_path):
    """A bad cell beyond the first blocks of the parser is found with its line."""
    rows = [f"{index},{index * 0.1!r},{'0.123456789' * 3}" for index in range(600_000)]
    rows[550_000] = "550000,oops,1"
    error = refused(
        csv(tmp_path, "# a\nt,q1,q2\n" + "\n".join(r.replace("0.1234567890.1234567890", "0.1") for r in rows))
    )
    assert (error.column, error.row) == ("q1", 550_003)


def test_trajectory_is_written_fast(tmp_path):
    """20,000 rows of 19 columns are written well within a second (0.04 s; the bound allows for a busy machine)."""
    values = np.random.default_rng(0).normal(size=(20_000, 19))
    start = time.perf_counter()
    write_table(tmp_path / "table.csv", {f"c{index}": values[:, index] for index in range(19)})
    assert time.perf_counter() - start < 1.0


@pytest.mark.parametrize(
    "content",
    ["t;q1\n0;1.5\n1;-2e-1\n", "t;q1\n0;1,5\n1,0;-2e-1\n", "t\tq1\n0\t1.5\n1\t-0.2\n", 't;q1\r\n0;"1,5"\r\n1;-,2\r\n'],
)
def test_semicolons_tabs_and_decimal_commas_are_read(tmp_path, content):
    """Cells may be separated by semicolons or tabs, and decimals by commas then."""
    table = read_table(csv(tmp_path, content))
    assert {name: column.tolist() for name, column in table.columns.items()} == {"t": [0.0, 1.0], "q1": [1.5, -0.2]}


def test_decimal_comma_that_comes_late_is_refused(tmp_path):
    """A decimal comma below many whole numbers is found with its line, not read as another number."""
    content = "t;q1\n" + "".join(f"{row};1\n" for row in range(500)) + "500;1,5\n"
    error = refused(csv(tmp_path, content))
    assert (error.column, error.row) == ("q1", 502)
