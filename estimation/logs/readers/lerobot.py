"""LeRobot data sets (v2.1 and v3): the episodes of a folder as logs of commands and positions."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from estimation.logs.readers.joint_names import places
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.signals import UNKNOWN_PAUSE, Log

STATE, ACTION = "observation.state", "action"
FULL, SLACK = 100.0, 1.0
"""Largest normalised value, and what rounding adds."""
BEYOND = 5.0
"""Degrees beyond a joint's limits from which on values are not degrees."""


def is_lerobot(path: Path) -> bool:
    """Whether a folder is a LeRobot data set."""
    return path.is_dir() and (path / "meta" / "info.json").is_file()


def read_lerobot(
    path: Path, joints: Sequence[str] | None = None, limits: tuple[Array, Array] | None = None
) -> list[Log]:
    """Reads each episode of a data set as a log, one after the other on one clock.

    Values are degrees, or normalised from -100 to 100 over each joint's range. Normalised ones are recognised where
    degrees would leave the joints' limits.

    Args:
        path: the folder.
        joints: names of the robot's joints in its order; the data set's own names may lack or add words.
        limits: lower and upper positions of these joints (n,) [rad].

    Raises:
        InputError: naming the file: no action or state, other joints, or values that are neither degrees nor
            normalised.
    """
    file = path / "meta" / "info.json"
    try:
        info = json.loads(file.read_text(encoding="utf-8"))
        features = info["features"]
    except (json.JSONDecodeError, UnicodeDecodeError, KeyError) as error:
        raise InputError(f"is no description of a data set ({type(error).__name__}: {error})", file=file) from error
    for key in (STATE, ACTION):
        if key not in features:
            raise InputError(f"the data set has no {key}", file=file, allowed=f"{STATE} and {ACTION}")
    state, action = (_order(features[key], key, file, joints) for key in (STATE, ACTION))
    frame = _frames(path)
    logs: list[Log] = []
    start = 0.0
    for number, rows in frame.groupby("episode_index", sort=True):
        t = rows["timestamp"].to_numpy(dtype=float)
        if len(t) < 2 or not (np.diff(t) > 0).all():
            t = np.arange(len(rows)) / float(info.get("fps", 30))
        q, command = (
            np.stack([np.asarray(value, dtype=float) for value in rows[key]])[:, order]
            for key, order in ((STATE, state), (ACTION, action))
        )
        (q, command), unit = _radians(q, command, limits, path)
        logs.append(
            Log(
                t=t - t[0] + start,
                q=q,
                command=command,
                name=f"{path.name} episode {number}",
                metadata={"file": str(path), "lerobot_unit": unit},
            )
        )
        start = float(logs[-1].t[-1]) + UNKNOWN_PAUSE
    return logs


def _order(feature: dict[str, Any], key: str, file: Path, joints: Sequence[str] | None) -> list[int]:
    """Places of the robot's joints in a vector."""
    names = feature.get("names")
    if isinstance(names, dict):
        names = next(iter(names.values()), None)
    count = int(feature["shape"][0])
    found = [str(name).removesuffix(".pos") for name in names] if names else [str(k + 1) for k in range(count)]
    if joints is None:
        return list(range(count))
    order = places(found, joints)
    if order is not None:
        return order
    if count == len(joints):
        return list(range(count))
    raise InputError(
        f"{key} has the joints {', '.join(found)}",
        file=file,
        allowed=f"{', '.join(joints)}, as the robot has",
        remedy="choose the robot's joints (--joints), or rename them",
    )


def _frames(path: Path) -> Any:
    import pandas as pd
    import pyarrow

    files = sorted((path / "data").rglob("*.parquet"))
    if not files:
        raise InputError("no data/**/*.parquet in the data set", file=path)
    columns = [STATE, ACTION, "timestamp", "episode_index"]
    parts = []
    for file in files:
        try:
            parts.append(pd.read_parquet(file, columns=columns))
        except (OSError, pyarrow.ArrowException, KeyError) as error:
            raise InputError(f"cannot be read ({str(error).splitlines()[0]})", file=file) from error
    return pd.concat(parts, ignore_index=True)


def _radians(
    q: Array, command: Array, limits: tuple[Array, Array] | None, path: Path
) -> tuple[tuple[Array, Array], str]:
    """Gives positions in radians, and which unit they had."""
    degrees = np.deg2rad(q), np.deg2rad(command)
    if limits is None:
        return degrees, "degrees"
    lower, upper = limits
    known = np.isfinite(lower) & np.isfinite(upper)
    slack = np.deg2rad(BEYOND)
    inside = (degrees[0] > lower - slack).all(axis=0) & (degrees[0] < upper + slack).all(axis=0)
    if inside[known].all():
        return degrees, "degrees"
    if known.all() and np.abs(q).max() <= FULL + SLACK:
        span = upper - lower
        return tuple(lower + (x + FULL) / (2 * FULL) * span for x in (q, command)), "normalised"  # type: ignore[return-value]
    joint = int(np.argmax(known & ~inside))
    raise InputError(
        f"values from {q[:, joint].min():.4g} to {q[:, joint].max():.4g}",
        file=path,
        joint=joint + 1,
        allowed=f"degrees within {np.rad2deg(lower[joint]):.4g} to {np.rad2deg(upper[joint]):.4g}, or -100 to 100",
        remedy="the description's zero or direction of this joint may differ from the data set's: export the episodes "
        "as CSV, and use a mapping (--mapping)",
    )
