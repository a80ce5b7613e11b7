"""The wind-up of a heavy arm's gears, by encoders on both sides of them."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
import yaml

from estimation.diagnosis.baseline import base_parameters, build_baseline
from estimation.diagnosis.posing import fit_values
from estimation.diagnosis.regularisation import pull_of
from estimation.diagnosis.states import record
from estimation.diagnosis.windup import measure_windups
from robots.loading import load_robot
from robots.robot import Robot
from robots.signals import Log


def kr300(folder: Path, at: Path) -> tuple[Robot, Log]:
    """The arm by its DH table, and its log with the link encoders of three joints."""
    described = json.loads((folder / "robot.json").read_text())
    known = {"pi": np.pi, "pi/2": np.pi / 2}

    def angle(value: object) -> float:
        text = str(value)
        return -known[text[1:]] if text.startswith("-") else known.get(text, 0.0)

    joints = [
        {"d": row["d"], "a": row["a"], "alpha": angle(row["alpha"]), "offset": angle(offset)}
        for row, offset in zip(described["dh_standard"], described["q_add"], strict=True)
    ]
    geometry = {"convention": "standard", "angles": "rad", "joints": joints}
    at.write_text(yaml.safe_dump({"name": "kr300", "base": {"rpy": [float(np.pi), 0.0, 0.0]}, "geometry": geometry}))
    table = pq.read_table(folder / "runA.parquet")

    def columns(prefix: str, count: int) -> np.ndarray:
        return np.column_stack([table[f"{prefix}{joint}"].to_numpy() for joint in range(1, count + 1)])

    qlink = np.full((len(table), 6), np.nan)
    qlink[:, :3] = columns("qse", 3)
    log = Log(t=table["t"].to_numpy(), q=columns("q", 6), tau=columns("taum", 6) * described["gear"], qlink=qlink)
    return load_robot(at), log


def test_a_heavy_arm_s_gears(data: Callable[[str], Path], tmp_path: Path) -> None:
    """The stiffness of joints 2 and 3 is that of the maker within its interval; joint 1 has too little load to tell.

    All three encoders behind the gears are late by the same 3 ms: proportional to velocity, that hides nine tenths of
    the wind-up until it is taken off.
    """
    robot, log = kr300(data("kuka_kr300_weigand"), tmp_path / "kr300.yaml")
    recording = record(robot, [log])
    base = build_baseline(base_parameters(robot, "polynomial", (0.001,) * 6), recording)
    values = fit_values(base, recording.tau.std(axis=0), recording.unsure, recording.tau, pull_of(base, recording))
    found = measure_windups(base.situation(recording, values), recording, [log], false_alarm=0.01)
    assert [windup.finding.joint for windup in found] == [2, 3]
    for windup, nominal in zip(found, (7.52e6, 4.10e6), strict=True):
        compliance, _, delay = windup.finding.parameters
        assert compliance.ci95[0] < 1 / nominal < compliance.ci95[1]
        assert delay.value == pytest.approx(3.0e-3, abs=1e-4)
        assert windup.finding.gain.ci95[0] > 0
