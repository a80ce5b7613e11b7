"""Which logs a model was fitted to, as its file says it."""

from __future__ import annotations

from collections.abc import Sequence

from robots.common.files import sha256
from robots.signals import Log


def describe_logs(logs: Sequence[Log]) -> list[dict[str, object]]:
    """Lists name, hash of the file where there is one, number of samples and duration [s] of each log."""
    described: list[dict[str, object]] = []
    for log in logs:
        file = log.metadata.get("file")
        described.append(
            {
                "name": log.name,
                "sha256": sha256(file) if file else None,
                "samples": len(log),
                "duration": log.duration,
            }
        )
    return described
