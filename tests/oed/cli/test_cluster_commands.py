"""``--cluster``: the same files as without it, and one message where it cannot work."""

from __future__ import annotations

import json
import socket
from dataclasses import replace
from pathlib import Path

import pytest

from oed.experiments import EFFORTS
from robots.common import clusters
from robots.common.clusters import connection
from tests.estimation.monitoring.arm import Arm, write


@pytest.mark.slow
@pytest.mark.longer
def test_design_is_the_same_file(run, robot, dask_cluster, tmp_path: Path, monkeypatch) -> None:
    """Searches on a cluster give the files of searches in one process, byte for byte."""
    monkeypatch.setitem(EFFORTS, "quick", replace(EFFORTS["quick"], islands=2))
    words = ("design", "--robot", robot, "--effort", "quick", "--periods", 1, "--quiet")
    assert run(*words, "--workers", 1, "--out", tmp_path / "here").code == 0
    assert run(*words, "--cluster", dask_cluster.scheduler_address, "--out", tmp_path / "there").code == 0
    for name in ("trajectory.csv", "design.json"):
        assert (tmp_path / "there" / name).read_bytes() == (tmp_path / "here" / name).read_bytes()


@pytest.mark.slow
def test_fleet_is_the_same_table(run, dask_cluster, tmp_path: Path, monkeypatch) -> None:
    """Robots on a cluster's workers give the table of one process, from relative paths, too."""
    arm = Arm(tmp_path)
    arm.model.save(tmp_path / "model.json")
    for k in range(2):
        write(arm.log(100.0 * k, 20.0), tmp_path / "logs" / f"robot{k}.csv")
    monkeypatch.chdir(tmp_path)
    words = ("fleet", "logs", "--model", ".", "--heat", "none", "--json", "--out")
    here = run(*words, "here", "--workers", 1)
    there = run(*words, "there", "--cluster", dask_cluster.scheduler_address)
    assert (here.code, there.code) == (0, 0)
    assert there.data == here.data


@pytest.mark.parametrize("command", ["design", "pareto", "campaign", "fleet"])
def test_a_wrong_address(run, robot, tmp_path: Path, monkeypatch, command: str) -> None:
    """An address without a scheduler is one message with code 2 within seconds, and leaves no folder."""
    pytest.importorskip("distributed", reason="a cluster needs the package distributed")
    monkeypatch.setattr(connection, "ANSWER_TIMEOUT", 0.1)
    (tmp_path / "logs").mkdir()
    words = (tmp_path / "logs", "--model", tmp_path) if command == "fleet" else ("--robot", robot)
    with socket.socket() as closed:
        closed.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{closed.getsockname()[1]}"
        done = run(command, *words, "--cluster", address, "--out", tmp_path / "out")
    assert done.code == 2
    (message,) = [line for line in done.err.splitlines() if not line.startswith("note: ")]
    assert message.startswith(f"oed: no Dask scheduler answers at {address}; ")
    assert not (tmp_path / "out").exists()


def test_not_beside_workers(run, robot, tmp_path: Path, monkeypatch) -> None:
    """Processes and a cluster exclude each other on a command line; what is typed takes the place of the file's."""
    done = run("design", "--robot", robot, "--workers", 2, "--cluster", "tcp://127.0.0.1:1", "--out", tmp_path / "out")
    assert done.code == 2
    assert "--workers and --cluster together" in done.err
    asked = []
    monkeypatch.setattr(clusters, "cluster", lambda address: asked.append(address) or pytest.fail("asked"))
    settings = tmp_path / "oed.toml"
    settings.write_text(f"workers = 2\nrobot = {json.dumps(str(robot))}\n")
    with pytest.raises(pytest.fail.Exception):
        run("design", "--config", settings, "--cluster", "tcp://127.0.0.1:1", "--out", tmp_path / "out")
    settings.write_text(f'cluster = "tcp://127.0.0.1:2"\nrobot = {json.dumps(str(robot))}\n')
    with pytest.raises(pytest.fail.Exception):
        run("design", "--config", settings, "--out", tmp_path / "out")
    assert asked == ["tcp://127.0.0.1:1", "tcp://127.0.0.1:2"]
    words = ("--effort", "quick", "--workers", 1, "--periods", 1, "--out", tmp_path / "out")
    assert run("design", "--config", settings, *words).code == 0


def test_package_is_missing(run, robot, tmp_path: Path, monkeypatch) -> None:
    """Without the package distributed, the message says what to install."""
    monkeypatch.setitem(__import__("sys").modules, "distributed", None)
    done = run("design", "--robot", robot, "--cluster", "tcp://127.0.0.1:1", "--out", tmp_path / "out")
    assert done.code == 2
    assert 'pip install "robot-oed[cluster]"' in done.err
