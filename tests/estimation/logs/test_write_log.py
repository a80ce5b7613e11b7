import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from estimation.logs import read_log, write_log
from robots.common.errors import InputError
from robots.common.tables.table_files import read_table
from robots.signals import Log

SUFFIXES = ("csv", "parquet")
FINITE = st.floats(allow_nan=False, allow_infinity=False)
SIGNALS = ("tau", "current", "dq", "ddq", "temperature", "qlink")
ALL = ("t", "q", *SIGNALS, "ambient", "segment", "cycle")


@st.composite
def logs(draw):
    rows, joints = draw(st.integers(2, 8)), draw(st.integers(1, 3))
    times = draw(st.lists(FINITE, min_size=rows, max_size=rows, unique=True))
    # A time of 0 among dates is a stamp that was never set, which the reader leaves out.
    assume(0.0 not in times or max(times) < 1e8)

    def matrix(elements=FINITE):
        return draw(arrays(np.float64, (rows, joints), elements=elements))

    fields = {name: matrix() for name in SIGNALS if name != "temperature" and draw(st.booleans())}
    if "tau" not in fields:
        fields["current"] = matrix()
    temperatures = st.floats(-50, 150) | st.just(np.nan)
    if draw(st.booleans()):
        fields["temperature"] = matrix(temperatures)
    if draw(st.booleans()):
        fields["ambient"] = draw(arrays(np.float64, rows, elements=temperatures))
    for name in ("segment", "cycle"):
        if draw(st.booleans()):
            fields[name] = draw(arrays(np.int64, rows, elements=st.integers(-(2**53), 2**53)))
    metadata = draw(
        st.fixed_dictionaries({}, optional={"robot": st.text(), "operator": st.text(), "period": st.just(0.004)})
    )
    return Log(np.sort(times), matrix(), **fields, metadata=metadata)


@pytest.mark.slow
@pytest.mark.parametrize("suffix", SUFFIXES)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None, max_examples=60)
@given(log=logs())
def test_log_reads_back_bit_by_bit(tmp_path, suffix, log):
    """Every field of a log reads back exactly, with what it says of itself."""
    path = tmp_path / f"log.{suffix}"
    write_log(path, log, force=True)
    read = read_log(path, n=log.n)
    for name in ALL:
        expected, found = getattr(log, name), getattr(read, name)
        assert (expected is None) == (found is None)
        if expected is not None:
            np.testing.assert_array_equal(found, expected)
    assert read.metadata == {**log.metadata, "file": str(path), "ignored_columns": []}


@pytest.fixture
def log():
    t = 0.004 * np.arange(5)
    q = np.column_stack([np.sin(t), np.cos(t)])
    return Log(
        t, q, tau=10 * q, dq=q, ddq=q, temperature=20 + q, ambient=20 + t, segment=np.arange(5), cycle=np.zeros(5)
    )


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_columns_have_the_names_and_units_of_the_format(tmp_path, log, suffix):
    """Columns are named and united as the log format says, time first."""
    path = tmp_path / f"log.{suffix}"
    write_log(path, log)
    table = read_table(path)
    joints = [f"{prefix}{joint}" for prefix in ("q", "dq", "ddq", "tau", "temp") for joint in (1, 2)]
    assert table.names == ("t", *joints, "temp_env", "segment", "cycle")
    units = {
        "t": "s",
        "q1": "rad",
        "dq2": "rad/s",
        "ddq1": "rad/s^2",
        "tau2": "N m",
        "temp1": "degC",
        "temp_env": "degC",
    }
    assert units.items() <= table.units.items()
    assert "segment" not in table.units


def test_pandas_reads_a_written_log(tmp_path, log):
    """A pandas user reads the CSV file with comment="#"."""
    write_log(tmp_path / "log.csv", log)
    frame = pd.read_csv(tmp_path / "log.csv", comment="#")
    np.testing.assert_allclose(frame[["q1", "q2"]].to_numpy(), log.q, rtol=1e-14)  # its parser rounds the last digit
    assert frame["segment"].dtype == np.int64


def test_log_is_not_overwritten_without_force(tmp_path, log):
    """An existing log stays without force."""
    path = tmp_path / "log.csv"
    write_log(path, log)
    before = path.read_bytes()
    with pytest.raises(InputError, match="force"):
        write_log(path, log.rows(slice(0, 3)))
    assert path.read_bytes() == before
    write_log(path, log.rows(slice(0, 3)), force=True)
    assert len(read_log(path)) == 3


def test_log_that_was_read_and_written_again_does_not_inherit_its_file(tmp_path):
    """The path and ignored columns of the first file are not carried into the second, nor its degrees."""
    first, second = tmp_path / "first.csv", tmp_path / "second.csv"
    first.write_text("# units: deg\nt,q1,tau1,x\n0,180,1,5\n1,90,2,6\n")
    write_log(second, read_log(first))
    read = read_log(second)
    assert read.metadata == {"file": str(second), "ignored_columns": []}
    np.testing.assert_allclose(read.q[:, 0], [np.pi, np.pi / 2], rtol=1e-15)  # one rounding of the conversion
