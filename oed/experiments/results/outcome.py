"""How one search of a design ended."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from robots.common.plain import all_finite, number


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """How one independent search ended.

    Attributes:
        island: its number, counted from 1.
        initial: the criterion at its first feasible point.
        final: the criterion of its best design.
        iterations: of the local solver.
        evaluations: of criterion and gradient.
        status: ``finished``, or what stopped it early.
        starts: of each random start, pulled within the limits, the criterion there and after the first solution.
    """

    island: int
    initial: float
    final: float
    iterations: int
    evaluations: int
    status: str
    starts: tuple[tuple[float, float], ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Writes plain data; null where a point did not excite all parameters."""
        data = {name: None if value != value else value for name, value in asdict(self).items()}
        return data | {"starts": [all_finite(pair) for pair in self.starts]}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Outcome:
        """Reads what `to_dict` wrote."""
        values: dict[str, Any] = {name: np.nan if value is None else value for name, value in data.items()}
        pairs = (map(number, pair) for pair in data.get("starts", ()))
        values["starts"] = tuple((before, after) for before, after in pairs)
        return cls(**values)
