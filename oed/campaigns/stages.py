"""A stage: a motion from home to home that is kept in one file and played as often as the timetable says."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from robots.common.errors import InputError
from robots.common.records import Record
from robots.limits import Margin
from robots.signals import Motion

STAGE_KINDS = ("power_on", "excitation", "friction", "warm_up")


@dataclass(frozen=True, kw_only=True, eq=False)
class Stage(Record):
    """A part of a campaign.

    Args:
        name: of the stage and, with ``.csv``, of its file.
        kind: one of `STAGE_KINDS`.
        motion: at the controller's period, from t = 0, at rest at home at both ends.
        segments: kind, start [s], end [s] and joint of its parts, as in a design file.
        plateaus: joint, speed [rad/s] with its sign, start [s] and end [s] of the stretches of constant speed of a
            friction stage.
        details: what else is worth knowing of it, as plain data.
        margins: the closest approach to each limit, by its own samples.
        freedom: of collisions, as `collision_data` writes it; None where they were not checked.

    Raises:
        InputError: an unknown kind, or a motion that is not uniform in time from zero.
    """

    ENTRIES = (
        "name",
        "kind",
        "file",
        "samples=motion.t.size",
        "duration",
        "segments",
        "plateaus",
        "details",
        "smallest_margins=margins",
        "collision=freedom",
    )

    name: str
    kind: str
    motion: Motion
    segments: tuple[Mapping[str, Any], ...]
    plateaus: tuple[Mapping[str, Any], ...] = ()
    details: Mapping[str, Any] = field(default_factory=dict)
    margins: tuple[Margin, ...] = ()
    freedom: Mapping[str, Any] | None = None

    def __post_init__(self) -> None:
        if self.kind not in STAGE_KINDS:
            raise InputError(f"found the stage kind {self.kind!r}", allowed=", ".join(STAGE_KINDS))
        if self.motion.period is None or abs(self.motion.t[0]) > 1e-9:
            raise InputError(f"the stage {self.name} is not uniform in time from zero")

    @property
    def file(self) -> str:
        """The name of its file."""
        return f"{self.name}.csv"

    @property
    def duration(self) -> float:
        """How long playing all its samples takes, one period each [s]."""
        return len(self.motion) * float(self.motion.period or 0.0)

    @property
    def violated(self) -> tuple[Margin, ...]:
        """Limits that it passes."""
        return tuple(margin for margin in self.margins if margin.violated)

    @property
    def tightest(self) -> Margin | None:
        """The limit that it comes closest to."""
        stated = (margin for margin in self.margins if np.isfinite(margin.limit))
        return min(stated, key=lambda margin: margin.slack_fraction, default=None)
