"""A log that is read in pieces against the same log in memory."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

import estimation.identifications.streams.pieces as pieces
import estimation.identifications.streams.survey as survey
import estimation.regressions.preparation as preparation
from estimation import identify, read_log, write_log
from estimation.identifications.choices import Candidates
from estimation.identifications.streams import identify_stream
from estimation.logs.parquet_streams import open_stream
from robots.common.errors import InputError
from robots.loading import load_robot
from robots.plants import nominal_plant, simulate
from robots.robot import Robot
from robots.signals import Motion
from tests.oed.cli.conftest import ROBOT

ROWS = 30_000
LOW_PASS = Candidates(smoothers=())


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    """A small planar arm."""
    path = tmp_path_factory.mktemp("robot") / "two.yaml"
    path.write_text(ROBOT.replace("VELOCITY", "2"))
    return load_robot(path)


@pytest.fixture(scope="module")
def file(robot: Robot, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two minutes of three tones a joint."""
    t = 0.004 * np.arange(ROWS)[:, None, None]
    w = 2 * np.pi * np.array([[0.11, 0.27, 0.61], [0.17, 0.37, 0.53]])
    a, phase = np.full((2, 3), 0.3) / w, np.array([[0.1, 1.0, 2.0], [0.7, 2.2, 4.0]])
    q, dq, ddq = (
        (scale * a * wave(t * w + phase)).sum(axis=2) for scale, wave in ((1, np.sin), (w, np.cos), (-(w**2), np.sin))
    )
    path = tmp_path_factory.mktemp("log") / "whole.parquet"
    write_log(path, simulate(nominal_plant(robot), Motion(t[:, 0, 0], q, dq, ddq), seed=1))
    return path


def in_parts(file: Path, folder: Path, rows: int, group: int) -> Path:
    """Writes the log as parts of so many rows, in row groups that fit neither parts nor pieces."""
    folder.mkdir()
    table = pq.read_table(file)
    for number, first in enumerate(range(0, len(table), rows)):
        pq.write_table(table.slice(first, rows), folder / f"part{number}.parquet", row_group_size=group)
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("parts", [False, True])
def test_pieces_sum_to_the_whole(
    robot: Robot, file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, parts: bool
) -> None:
    """Pieces, row groups and parts with borders anywhere give the values of the log in memory, to rounding."""
    for module in (pieces, preparation):
        monkeypatch.setattr(module, "SMOOTHED_ROWS", 7_000)
    path = in_parts(file, tmp_path / "parts", 11_000, 4_700) if parts else file
    whole = identify(robot, read_log(file), candidates=LOW_PASS)
    found = identify_stream(robot, open_stream(path, 2))
    scale = np.abs(whole.model.values).max()
    assert found.choice.low_pass == whole.choice.low_pass
    np.testing.assert_allclose(found.model.values, whole.model.values, rtol=0, atol=1e-9 * scale)
    # Fewer rows than the sandwich looks at: it sees the same ones.
    np.testing.assert_allclose(found.model.standard_errors, whole.model.standard_errors, rtol=1e-6)
    assert found.samples == len(whole.t)
    for one, other in zip(found.joints, whole.joints, strict=True):
        assert one.residual_rms == pytest.approx(other.residual_rms, rel=1e-9)
        assert one.noise_floor == pytest.approx(other.noise_floor, rel=1e-9)
        # The histogram's bins are 0.1 % wide.
        assert one.band == pytest.approx(other.band, rel=2e-3)


@pytest.mark.slow
def test_a_pause_between_parts(robot: Robot, file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts with a pause between them are fitted as two logs: nothing is interpolated, and names need no order."""
    monkeypatch.setattr(survey, "SURVEYED_ROWS", 8_000)
    folder = tmp_path / "parts"
    folder.mkdir()
    log = read_log(file)
    first, second = log.rows(slice(0, 15_000)), log.rows(slice(20_000, ROWS))
    write_log(folder / "z.parquet", first)
    write_log(folder / "a.parquet", second)
    stream = open_stream(folder, 2)
    assert stream.runs() == [(0, 15_000), (15_000, 25_000)]
    whole = identify(robot, [first, second], candidates=LOW_PASS, friction="polynomial")
    found = identify_stream(robot, stream, friction="polynomial")
    assert found.gates[0].parts == ((0, 15_000), (15_000, 25_000))
    difference = np.abs(found.model.values - whole.model.values) / whole.model.standard_errors
    assert (difference < 0.5).all()  # the same rows; the stretches that choose the cut-off are others


def test_refused_parts(file: Path, tmp_path: Path) -> None:
    """A part with other columns, in the time of another, empty, or cut off is named."""
    table = pq.read_table(file)
    cases = {
        "other columns": lambda path: pq.write_table(
            table.slice(2000, 1000).rename_columns(
                [name.replace("tau", "i") if name.startswith("tau") else name for name in table.column_names]
            ),
            path,
        ),
        "ends": lambda path: pq.write_table(table.slice(900, 1000), path),
        "no rows": lambda path: pq.write_table(table.slice(0, 0), path),
        "whole Parquet": lambda path: path.write_bytes(file.read_bytes()[:5000]),
    }
    for number, (text, write) in enumerate(cases.items()):
        folder = tmp_path / str(number)
        folder.mkdir()
        pq.write_table(table.slice(0, 1000), folder / "a.parquet")
        write(folder / "b.parquet")
        with pytest.raises(InputError, match=text) as raised:
            open_stream(folder, 2)
        assert raised.value.file == str(folder / "b.parquet") or raised.value.file == folder / "b.parquet"


def test_a_value_that_is_no_number_names_part_and_row(file: Path, tmp_path: Path) -> None:
    """A row's number counts within its part."""
    log = pq.read_table(file).to_pandas()
    log.loc[1205, "q2"] = np.nan
    log[:1000].to_parquet(tmp_path / "a.parquet")
    log[1000:2000].to_parquet(tmp_path / "b.parquet")
    with pytest.raises(InputError) as raised:
        open_stream(tmp_path, 2).rows(900, 1500)
    assert "b.parquet" in str(raised.value)
    assert raised.value.row == 206


def test_foreign_columns_with_a_mapping(file: Path, tmp_path: Path) -> None:
    """Names, units, signs and moments of another source give the rows that the whole log has."""
    log = pq.read_table(file).to_pandas()[:3000]
    foreign = {"stamp": pd.to_datetime(1.7e9 + log["t"], unit="s"), "note": "free text"}
    for joint in (1, 2):
        foreign[f"axis_{joint}_position_deg"] = -np.degrees(log[f"q{joint}"])
        foreign[f"axis_{joint}_torque"] = -log[f"tau{joint}"]
    frame = pd.DataFrame(foreign)
    frame[:1700].to_parquet(tmp_path / "b.parquet")
    frame[1700:].to_parquet(tmp_path / "a.parquet")
    with pytest.raises(InputError, match="column t: the column is missing") as raised:
        open_stream(tmp_path, 2)
    # The error proposes a mapping that names the right columns.
    assert "axis_{joint}_position_deg" in str(raised.value)
    (tmp_path / "mapping.yaml").write_text(
        "time: {column: stamp}\nposition: {columns: 'axis_{joint}_position_deg', unit: deg, sign: -1}\n"
        "torque: {columns: 'axis_{joint}_torque', sign: -1}\n"
    )
    stream = open_stream(tmp_path, 2)
    read = stream.rows(1000, 2500)
    np.testing.assert_allclose(read.t, 1.7e9 + log["t"][1000:2500], atol=1e-6, rtol=0)
    np.testing.assert_allclose(read.q, log[["q1", "q2"]][1000:2500], atol=1e-12)
    np.testing.assert_allclose(read.tau, log[["tau1", "tau2"]][1000:2500], atol=1e-12)
    (tmp_path / "mapping.yaml").write_text("time: {column: stamp}\ntorque: {columns: 'axis_{joint}_torque'}\n")
    with pytest.raises(InputError, match="column q1: the column is missing"):
        open_stream(tmp_path, 2)


def test_other_methods_are_refused(robot: Robot, file: Path) -> None:
    """A method that needs all rows says so."""
    with pytest.raises(InputError, match="needs all rows in memory"):
        identify_stream(robot, open_stream(file, 2), method="huber")
