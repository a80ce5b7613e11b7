"""What can be chosen of a motion for drives without torque."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from robots.common.errors import InputError
from robots.common.options import Option, Seed, numbers


@dataclass(frozen=True, kw_only=True)
class DriveDesignOptions:
    """Settings of `design_drive_motion`.

    Attributes:
        duration: length of the motion [s].
        segment: of each piece [s].
        period: of the command [s].
        fastest: highest frequency [Hz].
        reach: largest distance of a command from home [rad or m].
        noise: standard deviation of measured positions [rad or m].
        home: commanded position at start and end (n,); by default the middle of the range, within `reach` of zero.
        margin: share of the limits that is left.
        candidates: number of segments that are simulated at first.
        refinements: rounds in which so many segments near the best ones are simulated.
        seed: of their draw.

    Raises:
        InputError: a number that is not positive, a motion shorter than a segment, or a frequency too high for the
            period.
    """

    duration: float = 20.0
    segment: Annotated[float, Option(hidden=True)] = 2.5
    period: Annotated[float, Option(hidden=True)] = 0.002
    fastest: Annotated[float, Option(hidden=True)] = 5.0
    reach: Annotated[float, Option(hidden=True)] = 0.5
    noise: Annotated[float, Option(hidden=True)] = 2e-4
    home: Annotated[tuple[float, ...] | None, Option(reads=numbers, section="Robot")] = None
    margin: Annotated[float, Option(hidden=True)] = 0.1
    candidates: Annotated[int, Option(hidden=True)] = 60
    refinements: Annotated[int, Option(hidden=True)] = 3
    seed: Seed = 0

    def __post_init__(self) -> None:
        for name in ("duration", "segment", "period", "fastest", "reach", "noise"):
            if not getattr(self, name) > 0:
                raise InputError(f"{name} {getattr(self, name)}", allowed="a positive number")
        if self.duration < self.segment:
            raise InputError(f"a motion of {self.duration:g} s", allowed=f"{self.segment:g} s or more")
        if self.fastest * self.period > 0.25:
            raise InputError(f"{self.fastest:g} Hz by samples of {self.period:g} s", allowed="a quarter of their rate")
