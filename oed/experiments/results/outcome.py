"""How one search of a design ended."""

from __future__ import annotations

from dataclasses import dataclass

from robots.common.records import Record


@dataclass(frozen=True, kw_only=True)
class Outcome(Record):
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
