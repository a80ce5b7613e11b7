"""A benchmark of two short cases with a known truth, without the plant."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from oed.benchmarks.folders import Benchmark, read_benchmark
from oed.benchmarks.sealing import seal

ROWS, JOINTS = 400, 2
NOISE = 0.5  # RMS of the noise in the held-back torque [N m]


def effect(name: str, joint: int | None, **parameters: float) -> dict[str, Any]:
    """An effect of the sealed answers."""
    return {
        "effect": name,
        "formula": name,
        "joint": joint,
        "amount": 1.0,
        "visible": 0.01,
        "parameters": parameters,
    }


TRUTHS: dict[str, tuple[str, list[dict[str, Any]]]] = {
    "case-001": ("nothing", []),
    "case-002": ("one", [effect("stribeck", 2, stribeck_velocity=0.1)]),
    "case-003": ("two", [effect("spring", 1), effect("payload_change", None, change_time=3.0, mass=2.0)]),
    "case-004": ("outside", [effect("outside", 1)]),
}


@pytest.fixture
def blind(tmp_path: Path) -> Benchmark:
    """A public folder with four cases, and its sealed answers. The held-back torque is 1 N m on both joints."""
    folder = tmp_path / "blind"
    t = np.arange(ROWS) * 0.01
    sealed = {}
    for name, (stratum, effects) in TRUTHS.items():
        (folder / name).mkdir(parents=True)
        facts = {
            "format": "oed-benchmark-case",
            "format_version": 1,
            "case": name,
            "joints": JOINTS,
            "robot": {"yaml": "robot.yaml", "urdf": "robot.urdf"},
            "unseen": {"rows": ROWS},
            "noise": {"torque_rms_over_signal_rms": 0.025},
        }
        (folder / name / "case.json").write_text(json.dumps(facts))
        truth = {"stratum": stratum, "effects": effects, "noise": [NOISE] * JOINTS, "noise_level": 0.025}
        sealed[name] = (truth, np.column_stack([t, np.ones((ROWS, JOINTS))]))
    with (tmp_path / "blind.answers").open("wb") as stream:
        digest = seal(stream, "0123456789abcdef", sealed)
    manifest = {
        "format": "oed-benchmark",
        "format_version": 1,
        "id": "0123456789abcdef",
        "cases": list(TRUTHS),
        "commitment": {"sha256": digest},
    }
    (folder / "benchmark.json").write_text(json.dumps(manifest))
    return read_benchmark(folder)


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    """Writes a file of answers from its cases; other entries may be replaced."""

    def write(cases: Any, called: str = "tool", **other: Any) -> Path:
        data = {
            "format": "oed-benchmark-answers",
            "format_version": 1,
            "benchmark": "0123456789abcdef",
            "tool": {"name": called},
            "cases": cases,
        }
        path = tmp_path / f"{called}.json"
        path.write_text(json.dumps(data | other))
        return path

    return write


@pytest.fixture
def predict(tmp_path: Path) -> Callable[..., str]:
    """Writes a predicted torque and returns its name."""

    def predict(torque: np.ndarray, name: str = "predicted.csv") -> str:
        header = ",".join(f"tau{j + 1}" for j in range(torque.shape[1]))
        np.savetxt(tmp_path / name, torque, delimiter=",", header=header, comments="")
        return name

    return predict
