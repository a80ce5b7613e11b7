"""The KUKA KR300 of Weigand (2021): its DH table as a description, and its log with encoders behind three gears."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import yaml

from robots.loading import load_robot
from robots.robot import Robot
from robots.signals import Log

_ANGLES = {"pi": np.pi, "pi/2": np.pi / 2, "-pi": -np.pi, "-pi/2": -np.pi / 2}


def kr300(folder: Path, at: Path) -> tuple[Robot, Log]:
    """Writes the description to ``at``, and reads both; torques are of the link's side."""
    described = json.loads((folder / "robot.json").read_text())

    def angle(value: str | float) -> float:
        return float(_ANGLES.get(str(value), value))

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
    tau = columns("taum", 6) * described["gear"]
    return load_robot(at), Log(t=table["t"].to_numpy(), q=columns("q", 6), tau=tau, qlink=qlink, name="runA")
