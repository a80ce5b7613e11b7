"""What can be chosen of an estimate of external forces."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Literal

from robots.common.errors import InputError
from robots.common.options import Option, Point

Velocity = Literal["smoothed", "logged"]


@dataclass(frozen=True, kw_only=True)
class ForceOptions:
    """Choices of `estimate_forces`.

    Attributes:
        false_alarms: rate of false alarms of a robot without contact, an hour.
        bandwidth: bandwidth of the observer [Hz]. A push of 0.2 s is five time constants of the usual one.
        tool: tool point in the flange frame, as X,Y,Z [m]. Default: the flange.
        velocity: velocities: smoothed (from positions) or logged (columns dq1..).

    Raises:
        InputError: another kind of velocities, or a bandwidth that is not positive.
    """

    false_alarms: Annotated[float, Option(name="false-alarms-per-hour")] = 1.0
    bandwidth: float = 4.0
    tool: Point = None
    velocity: Velocity = "smoothed"

    def __post_init__(self) -> None:
        if self.velocity not in ("smoothed", "logged"):
            raise InputError(f"velocity {self.velocity!r}", allowed="smoothed or logged")
        if not 0.0 < self.bandwidth < math.inf:
            raise InputError(f"a bandwidth of {self.bandwidth} Hz", allowed="a positive number")
