"""What a benchmark holds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from oed.benchmarks.truth.kinds import KINDS
from robots.common.errors import InputError
from robots.common.options import Option, names


@dataclass(frozen=True, kw_only=True)
class MakeOptions:
    """What a benchmark holds.

    Attributes:
        cases: number of cases.
        robots: kinds of robots, comma-separated: ur10, panda, heavy (200 kg class), er3a.
        size: visible size of a single effect, the RMS that the base model cannot fit over the joint's torque RMS. Each
            of two effects has three times the size.
        noise: RMS of the torque noise over the torque RMS; half of its variance is coloured.
        duration: duration of each log [s].
        unseen: duration of each unseen motion [s].

    Raises:
        InputError: a number out of its range, or a robot that the plant does not have.
    """

    cases: int = 24
    robots: Annotated[tuple[str, ...], Option(reads=names)] = KINDS
    size: float = 0.01
    noise: float = 0.025
    duration: float = 60.0
    unseen: float = 30.0

    def __post_init__(self) -> None:
        if self.cases < 1:
            raise InputError(f"{self.cases} cases", allowed="1 or more")
        for robot in self.robots or ("",):
            if robot not in KINDS:
                raise InputError(f"the plant has no robot {robot!r}", allowed=", ".join(KINDS))
        # [s]: a shorter log determines no base model.
        shortest = 10.0
        for name, value, lower, upper in (
            ("size", self.size, 1e-3, 0.2),
            ("noise", self.noise, 1e-4, 0.5),
            ("duration", self.duration, shortest, 3600.0),
            ("unseen", self.unseen, shortest, 3600.0),
        ):
            if not lower <= value <= upper:
                raise InputError(f"{name} {value:g}", allowed=f"{lower:g} to {upper:g}")
