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


def are_same_log(log: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    """Whether two of what `describe_logs` gives are of one log: by their files; without them by start and samples."""
    keys = ("sha256",) if log["sha256"] and other["sha256"] else ("start", "samples")
    return all(log[key] == other[key] for key in keys)
