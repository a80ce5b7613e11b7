"""Which logs a model was fitted to, as its file says it."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from robots.common.files import sha256
from robots.common.plain import all_finite, finite
from robots.signals import Log

BAG_FILES = (".db3", ".mcap")
"""Suffixes of the files in a folder of rosbag 2 that hold messages."""


def describe_logs(logs: Sequence[Log]) -> list[dict[str, object]]:
    """Lists name, hash of the file where there is one, number of samples, start and duration [s] of each log.

    A log whose torques were converted gives what they were. A log with temperatures also gives the mean of each joint
    and of the ambient [degC], null where a sensor was silent.
    """
    described: list[dict[str, object]] = []
    for log in logs:
        file = log.metadata.get("file")
        described.append(
            {
                "name": log.name,
                "sha256": log_hash(file) if file else None,
                "samples": len(log),
                "start": float(log.t[0]),
                "duration": log.duration,
                **_temperatures(log),
                **({"torque_was": was} if (was := log.metadata.get("torque_was")) else {}),
            }
        )
    return described


def _temperatures(log: Log) -> dict[str, object]:
    """Mean temperatures [degC] of the joints (n,) and of the ambient, as far as the log has them."""
    found: dict[str, object] = {}
    for key, values in (("temperature", log.temperature), ("ambient", log.ambient)):
        if values is not None:
            known = np.isfinite(values)
            mean = np.where(known, values, 0.0).sum(axis=0) / np.where(known.any(axis=0), known.sum(axis=0), np.nan)
            found[key] = all_finite(mean) if values.ndim == 2 else finite(float(mean))
    return found


def log_hash(path: str | PathLike[str]) -> str:
    """Returns the SHA-256 digest of a log as 64 hexadecimal digits.

    A folder of rosbag 2 counts by the files that hold its messages. With one such file it has the digest of this file,
    so that the folder and the file are the same log.

    Args:
        path: a file, or the folder of a rosbag 2.

    Raises:
        InputError: a file is missing or cannot be read.
    """
    place = Path(path)
    if not place.is_dir():
        return sha256(place)
    digests = [sha256(file) for file in sorted(place.iterdir()) if file.suffix in BAG_FILES]
    return digests[0] if len(digests) == 1 else hashlib.sha256("".join(digests).encode()).hexdigest()


def are_same_log(log: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    """Whether two of what `describe_logs` gives are of one log: by their files; without them by start and samples."""
    keys = ("sha256",) if log["sha256"] and other["sha256"] else ("start", "samples")
    return all(log[key] == other[key] for key in keys)
