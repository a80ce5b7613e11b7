"""The log that is written row by row."""

from __future__ import annotations

import resource
from pathlib import Path

import numpy as np
import pytest

from estimation import read_log
from oed.controllers.errors import RecordingError
from oed.controllers.recording.log_file import FeedbackLog
from oed.controllers.recording.statistics import Statistics
from robots.common.errors import InputError

COLUMNS = ["t", "q1", "q2"]
UNITS = {"t": "s", "q1": "rad", "q2": "rad"}


def test_rows_and_header(tmp_path: Path) -> None:
    """The log reads back bit by bit; what is known at the end stands in its block."""
    path = tmp_path / "log.csv"
    log = FeedbackLog(path, COLUMNS, UNITS, {"robot": "two", "complete": False})
    rows = np.random.default_rng(0).standard_normal((100, 2))
    for k, row in enumerate(rows):
        log.append(0.004 * k, row.tolist())
    log.close()
    log.complete({"complete": True, "message_delay": 0.001})
    read = read_log(path, 2, torque=False)
    np.testing.assert_array_equal(read.q, rows)
    np.testing.assert_array_equal(read.t, 0.004 * np.arange(100))
    assert (read.metadata["complete"], read.metadata["message_delay"]) == (True, 0.001)


def test_flushed_rows_can_be_read_before_the_end(tmp_path: Path) -> None:
    """A log that was never closed can be read up to what was written."""
    log = FeedbackLog(tmp_path / "log.csv", COLUMNS, UNITS, {"complete": False})
    for k in range(10):
        log.append(0.1 * k, [k, -k])
    log.flush()
    read = read_log(tmp_path / "log.csv", 2, torque=False)
    assert (len(read), read.metadata["complete"]) == (10, False)
    log.close()


def test_existing_file_stays(tmp_path: Path) -> None:
    """An existing file is replaced with force only."""
    path = tmp_path / "log.csv"
    path.write_text("kept")
    with pytest.raises(InputError, match="exists"):
        FeedbackLog(path, COLUMNS, UNITS, {})
    assert path.read_text() == "kept"
    FeedbackLog(path, COLUMNS, UNITS, {}, force=True).close()
    assert path.read_text() != "kept"


def write_until_full(log: FeedbackLog) -> None:
    """Append rows to a log until the disk is full."""
    for k in range(100_000):
        log.append(0.004 * k, [k / 3, -k / 7])
        if k % 50 == 0:
            log.flush()


def test_full_disk(tmp_path: Path) -> None:
    """On a full disk recording ends with one message, and the log is whole up to its last line."""
    path = tmp_path / "log.csv"
    log = FeedbackLog(path, COLUMNS, UNITS, {"complete": False})
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, before[1]))
    try:
        with pytest.raises(RecordingError, match="recording stopped"):
            write_until_full(log)
        log.close()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    read = read_log(path, 2, torque=False)
    assert 15_000 < path.stat().st_size <= 20_000
    assert len(read) == log.rows
    np.testing.assert_array_equal(read.q[:, 0], np.arange(len(read)) / 3)


def test_disk_that_is_full_at_an_end(tmp_path: Path) -> None:
    """Rows that are lost when the log is closed are an error; without room for the header there is no file."""
    path = tmp_path / "log.csv"
    log = FeedbackLog(path, COLUMNS, UNITS, {"complete": False})
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (path.stat().st_size + 100, before[1]))
    try:
        for k in range(50):
            log.append(0.5 * k, [k, -k])
        with pytest.raises(RecordingError, match="recording stopped"):
            log.close()
        resource.setrlimit(resource.RLIMIT_FSIZE, (100, before[1]))
        with pytest.raises(RecordingError):
            FeedbackLog(tmp_path / "other.csv", COLUMNS, UNITS, {})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert 5 < len(read_log(path, 2, torque=False)) == log.rows < 50
    assert not (tmp_path / "other.csv").exists()


def test_one_program_a_file(tmp_path: Path) -> None:
    """A file that is being recorded is not replaced with force either, until it is closed."""
    path = tmp_path / "log.csv"
    first = FeedbackLog(path, COLUMNS, UNITS, {})
    first.append(0.0, [1.0, 2.0])
    with pytest.raises(InputError, match="another program is recording into this file"):
        FeedbackLog(path, COLUMNS, UNITS, {}, force=True)
    first.append(0.1, [3.0, 4.0])
    first.close()
    assert len(read_log(path, 2, torque=False)) == 2
    FeedbackLog(path, COLUMNS, UNITS, {}, force=True).close()


def test_nothing_is_lost_by_tcp() -> None:
    """Stamps that jitter by more than a period are no gaps on a link that loses nothing."""
    stamps = 0.004 * np.arange(200) + np.where(np.arange(200) % 7 == 0, 0.009, 0.0)
    for reliable in (True, False):
        statistics = Statistics(reliable)
        statistics.stamped = True
        for stamp in np.sort(stamps):
            statistics.add(float(stamp), float(stamp))
        assert (statistics.summary()["lost"] == 0) == reliable


def test_loss_and_jitter() -> None:
    """Missing time stamps count as lost, and the spread of the arrivals as jitter."""
    rng = np.random.default_rng(1)
    kept = np.sort(rng.choice(np.arange(1, 2000), 1900, replace=False))
    kept = np.concatenate([[0], kept, [2000]])
    statistics = Statistics()
    statistics.stamped = True
    arrivals = 0.004 * kept + rng.uniform(0, 0.001, len(kept))
    for k, arrival in zip(kept, arrivals, strict=True):
        statistics.add(0.004 * k, arrival)
    summary = statistics.summary()
    assert summary["lost"] == 99
    assert summary["rows"] == 1902
    assert summary["period"] == pytest.approx(0.004)
    assert summary["arrival_jitter"] == pytest.approx(np.diff(arrivals).std(), rel=1e-9)
    assert summary["longest_gap"] == pytest.approx(np.diff(arrivals).max())
