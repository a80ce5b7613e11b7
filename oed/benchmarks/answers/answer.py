"""What a tool says of a benchmark's cases."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from robots.common.arrays import Array

VERDICTS = ("nothing", "effects", "unexplained")


@dataclass(frozen=True, kw_only=True)
class StatedValue:
    """A parameter's value, and its 95 % interval if the tool states one."""

    value: float
    interval: tuple[float, float] | None = None


@dataclass(frozen=True, kw_only=True)
class NamedEffect:
    """An effect that a tool claims.

    Attributes:
        effect: an exact name, a class, or ``unknown``.
        joints: from 1; empty for the whole robot.
        parameters: values by name.
        confidence: probability that class and joint are right, or None.
    """

    effect: str
    joints: tuple[int, ...] = ()
    parameters: Mapping[str, StatedValue] = field(default_factory=lambda: MappingProxyType({}))
    confidence: float | None = None


@dataclass(frozen=True, kw_only=True)
class CaseAnswer:
    """What a tool says of one case.

    Attributes:
        verdict: ``nothing``, ``effects`` or ``unexplained``.
        effects: strongest first.
        torque: predicted torque of the unseen motion (N, n) [N m], or None.
    """

    verdict: str
    effects: tuple[NamedEffect, ...] = ()
    torque: Array | None = None


@dataclass(frozen=True, kw_only=True)
class Answers:
    """What a tool says of a benchmark.

    Attributes:
        tool: its name.
        version: its version, or an empty text.
        benchmark: identity of the benchmark.
        cases: by name; cases that are missing count as wrong.
        file: where they were read from.
    """

    tool: str
    version: str
    benchmark: str
    cases: Mapping[str, CaseAnswer]
    file: Path | None = None
