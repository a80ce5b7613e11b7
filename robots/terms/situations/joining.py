"""Concatenation of situations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from robots.regressor import TorqueModel
from robots.terms.situations.situation import Situation


def join_situations(parts: Sequence[Situation], model: TorqueModel | None = None) -> Situation:
    """Joins situations of one robot on one clock; the parameters are those of the first.

    Args:
        parts: one or more situations; their payloads and gravities may differ.
        model: the base model under the gravity of the robot's description; by default that of the first part.

    Returns:
        The joined situation.
    """
    model = model or parts[0].model
    if len(parts) == 1 and parts[0].model is model:
        return parts[0]
    edges = np.cumsum([0, *(len(part) for part in parts[:-1])])
    names = ("t", "q", "dq", "ddq", "rigid", "friction", "torque")
    merged: dict[str, Any] = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
    return replace(
        parts[0],
        model=model,
        **merged,
        starts=tuple(int(edge) + start for edge, part in zip(edges, parts, strict=True) for start in part.starts),
        parts=tuple(parts),
        _cache={},
    )
