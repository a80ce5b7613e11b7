"""Gear ratios from a robot's description."""

from __future__ import annotations

from pathlib import Path

import yaml

Gears = tuple[float | None, ...]


def gear_ratios(file: Path, joints: int) -> Gears:
    """Reads the gear ratio of each joint; None where the description states none.

    Args:
        file: the robot's YAML file.
        joints: number of joints.
    """
    described = yaml.safe_load(file.read_text(encoding="utf-8"))
    drives = (described.get("dynamics") or {}).get("drives") or {}
    values = (drives.get("gear_ratio") or {}).get("values")
    return tuple(map(float, values)) if values else (None,) * joints
