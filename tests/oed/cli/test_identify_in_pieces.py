"""``oed identify --stream``: a log that is read in pieces, from the command line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from estimation import load_model, read_log, write_log


@pytest.fixture
def parts(experiment: Path, tmp_path: Path) -> Path:
    """The small robot's log as a folder of two Parquet parts."""
    log = read_log(experiment / "log.csv")
    folder = tmp_path / "day"
    folder.mkdir()
    for number, rows in enumerate(np.array_split(np.arange(len(log)), 2)):
        write_log(folder / f"part{number}.parquet", log.rows(slice(rows[0], rows[-1] + 1)))
    return folder


@pytest.mark.slow
def test_a_payload_is_known(run, robot: Path, parts: Path, tmp_path: Path) -> None:
    """A stated payload and gravity act as they do on a log in memory."""
    whole = tmp_path / "whole.parquet"
    both = [read_log(path) for path in sorted(parts.iterdir())]
    joined = {name: np.concatenate([getattr(log, name) for log in both]) for name in ("t", "q", "tau")}
    write_log(whole, type(both[0])(**joined))
    setup = ("--payload", "1=0.2,0.1,0,0", "--gravity", "1=0.2,0,-9.8", "--friction", "polynomial", "--no-position")
    for way, log in (("--stream", parts), ("--no-stream", whole)):
        done = run("identify", "--robot", robot, "--log", log, *setup, way, "--out", tmp_path / way[2:], "--json")
        assert done.code == 0, done.err
    found, expected = (load_model(tmp_path / name) for name in ("stream", "no-stream"))
    rows = json.loads((tmp_path / "stream" / "model.json").read_text())["provenance"]["read_in_pieces"]
    assert rows["rows"] == rows["kept"] > 0
    # Only the smoothing may differ: in memory there are more smoothers to choose from.
    assert (np.abs(found.values - expected.values) < 0.5 * expected.standard_errors).all()


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (("--mapping", "columns.yaml"), "columns.yaml"),
        (("--method", "huber"), "needs all rows in memory"),
        (("--log", "other.parquet"), "--stream with 2 logs"),
    ],
)
def test_what_pieces_do_not_take(run, robot: Path, parts: Path, tmp_path: Path, options, text: str) -> None:
    """A mapping that is not there, a method that needs all rows, and two logs are refused by name."""
    out = tmp_path / "out"
    done = run("identify", "--robot", robot, "--log", parts, "--stream", "--out", out, *options)
    assert done.code == 2
    assert text in done.err
    assert not out.exists()
