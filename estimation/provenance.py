"""Which logs a model was fitted to, as its file says it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from robots.common.files import sha256
from robots.signals import Log


def describe_logs(logs: Sequence[Log]) -> list[dict[str, object]]:
    """Lists name, hash of the file where there is one, number of samples, start and duration [s] of each log."""
    described: list[dict[str, object]] = []
    for log in logs:
        file = log.metadata.get("file")
        described.append(
            {
                "name": log.name,
                "sha256": sha256(file) if file else None,
                "samples": len(log),
                "start": float(log.t[0]),
                "duration": log.duration,
            }
        )
    return described


def is_described(log: Log, known: Mapping[str, Any]) -> bool:
    """Whether a log is the one that `describe_logs` described: by its file; without one by start and samples."""
    file = log.metadata.get("file")
    if file and known["sha256"]:
        return sha256(file) == known["sha256"]
    return len(log) == known["samples"] and float(log.t[0]) == known["start"]
