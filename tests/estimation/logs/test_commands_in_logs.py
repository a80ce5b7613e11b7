"""Commanded positions in logs: columns, LeRobot data sets and PACE's files."""

from __future__ import annotations

import io
import json
import pickle
import zipfile
from collections import OrderedDict
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from estimation.logs import read_log
from estimation.logs.readers.lerobot import is_lerobot, read_lerobot
from robots.common.errors import InputError

NAMES = ["shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper"]


def data_set(folder: Path, state: np.ndarray, action: np.ndarray, version: str) -> Path:
    """Write a LeRobot data set of two episodes."""
    (folder / "meta").mkdir(parents=True)
    feature = {"dtype": "float32", "shape": [6], "names": [f"{name}.pos" for name in NAMES]}
    info = {"codebase_version": version, "fps": 30, "features": {"action": feature, "observation.state": feature}}
    (folder / "meta" / "info.json").write_text(json.dumps(info))
    half = len(state) // 2
    parts = []
    for episode, rows in enumerate((slice(0, half), slice(half, None))):
        q, command = state[rows], action[rows]
        parts.append(
            pd.DataFrame(
                {
                    "action": list(command.astype(np.float32)),
                    "observation.state": list(q.astype(np.float32)),
                    "timestamp": (np.arange(len(q)) / 30).astype(np.float32),
                    "episode_index": episode,
                }
            )
        )
    chunk = folder / "data" / "chunk-000"
    chunk.mkdir(parents=True)
    if version == "v2.1":
        for episode, part in enumerate(parts):
            part.to_parquet(chunk / f"episode_{episode:06d}.parquet")
    else:
        pd.concat(parts).to_parquet(chunk / "file-000.parquet")
    return folder


@pytest.mark.parametrize("version", ["v2.1", "v3.0"])
def test_lerobot_episodes_are_logs(tmp_path: Path, version: str) -> None:
    """Each episode is a log in radians on one clock, with commands, whatever the joints' order."""
    state = np.random.default_rng(0).uniform(-60, 60, (80, 6))
    folder = data_set(tmp_path / "set", state, state + 1, version)
    assert is_lerobot(folder)
    order = NAMES[::-1]
    logs = read_lerobot(folder, order)
    assert [len(log) for log in logs] == [40, 40]
    assert logs[1].t[0] > logs[0].t[-1]
    # The files hold single precision.
    assert np.allclose(np.rad2deg(logs[0].q), state[:40, ::-1], atol=1e-4)
    assert logs[0].command is not None
    assert np.allclose(logs[0].command - logs[0].q, np.deg2rad(1), atol=1e-5)


def test_normalised_values_are_recognised(tmp_path: Path) -> None:
    """Values within 100 that would leave the joints' limits as degrees are shares of the range."""
    state = np.linspace(-100, 100, 60)[:, None] * np.ones(6)
    folder = data_set(tmp_path / "set", state, state, "v3.0")
    lower, upper = np.full(6, -0.5), np.full(6, 1.5)
    logs = read_lerobot(folder, NAMES, (lower, upper))
    assert logs[0].metadata["lerobot_unit"] == "normalised"
    assert logs[0].q[0] == pytest.approx(lower)
    assert logs[1].q[-1] == pytest.approx(upper)
    folder = data_set(tmp_path / "ticks", 10 * state, state, "v3.0")
    with pytest.raises(InputError, match=r"joint 1: values from -1000 to .* within -28\.65 to 85\.94"):
        read_lerobot(folder, NAMES, (lower, upper))


def test_a_data_set_of_other_joints_is_refused(tmp_path: Path) -> None:
    """The message lists the data set's joints and the robot's."""
    folder = data_set(tmp_path / "set", np.zeros((60, 6)), np.zeros((60, 6)), "v3.0")
    with pytest.raises(InputError, match=r"observation\.state has the joints shoulder_pan"):
        read_lerobot(folder, ["a", "b"])


def torch_file(path: Path, arrays: dict[str, np.ndarray]) -> None:
    """Write what torch.save writes of a dictionary of tensors: opcodes by hand, for torch is not installed."""
    out = io.BytesIO()
    out.write(b"\x80\x02}(")

    def text(value: str) -> bytes:
        raw = value.encode()
        return b"X" + len(raw).to_bytes(4, "little") + raw

    def number(value: int) -> bytes:
        return b"J" + value.to_bytes(4, "little", signed=True)

    for k, (name, array) in enumerate(arrays.items()):
        strides = tuple(step // array.itemsize for step in array.strides)
        out.write(text(name) + b"ctorch._utils\n_rebuild_tensor_v2\n((")
        out.write(text("storage") + b"ctorch\nFloatStorage\n" + text(str(k)) + text("cpu") + number(array.size) + b"tQ")
        out.write(number(0))
        out.write(b"(" + b"".join(number(n) for n in array.shape) + b"t")
        out.write(b"(" + b"".join(number(n) for n in strides) + b"t")
        out.write(b"\x89ccollections\nOrderedDict\n)RtR")
    out.write(b"u.")
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("run/data.pkl", out.getvalue())
        for k, array in enumerate(arrays.values()):
            archive.writestr(f"run/data/{k}", array.astype("<f4").tobytes())


def test_a_torch_file_is_read_without_torch(tmp_path: Path) -> None:
    """PACE's keys become time, positions and commands."""
    t = np.arange(60, dtype="f4") / 100
    q = np.random.default_rng(0).normal(size=(60, 3)).astype("f4")
    torch_file(tmp_path / "run.pt", {"time": t, "dof_pos": q, "des_dof_pos": q + 1})
    log = read_log(tmp_path / "run.pt", 3, torque=False)
    assert np.allclose(log.q, q)
    assert log.command is not None
    assert np.allclose(log.command, q + 1)


def test_a_pickle_that_runs_code_is_refused(tmp_path: Path) -> None:
    """Anything but tensors and plain values ends with a message, and runs nothing."""
    with zipfile.ZipFile(tmp_path / "run.pt", "w") as archive:
        archive.writestr("run/data.pkl", pickle.dumps({"a": OrderedDict, "b": Path("x")}))
    with pytest.raises(InputError, match=r"run.pt: the .pt file cannot be read \(it holds pathlib"):
        read_log(tmp_path / "run.pt", 3, torque=False)


def test_columns_of_commands(tmp_path: Path) -> None:
    """qref1..qrefn are read with their unit; without torque nothing warns that nothing can be identified."""
    t = np.arange(60) / 100
    table = pd.DataFrame({"t": t, "q1": np.sin(t), "qref1": 57.0 * np.sin(t)})
    path = tmp_path / "run.csv"
    path.write_text("# units: {qref: deg}\n" + table.to_csv(index=False))
    log = read_log(path, 1, torque=False)
    assert log.command is not None
    assert np.allclose(log.command[:, 0], np.deg2rad(57.0) * np.sin(t))
    assert not any(note["name"] == "no_torque" for note in log.metadata.get("repairs", ()))
