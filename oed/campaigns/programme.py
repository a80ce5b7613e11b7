"""The programme of a campaign: number, kind and duration of its cycles."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from oed.trajectories.stage_defaults import FRICTION_LEVELS, LONGEST_PLATEAU, RANGE_FRACTION
from robots.common.errors import InputError
from robots.common.options import Option
from robots.common.records import Record

LONGEST_CAMPAIGN = 7 * 24 * 3600.0
"""A campaign beyond a week is taken for a slip of the pen [s]."""


def read_duties(option: str, text: str) -> tuple[float, ...]:
    """Reads duty cycles in percent.

    Args:
        option: for the message.
        text: as typed.

    Raises:
        InputError: something else.
    """
    try:
        return tuple(float(part) / 100.0 for part in text.split(","))
    except ValueError:
        allowed = "percentages separated by commas, such as 20,40,60,100"
        raise InputError(f"{option} {text}", allowed=allowed) from None


@dataclass(frozen=True, kw_only=True)
class Programme(Record):
    """Power-on test, then for each duty cycle a run of heating cycles and a cooling test.

    A heating cycle is excitation, friction sweeps and warm-up (thesis section 2.4.1); in a cooling test the robot
    stands still but for one friction stage at the beginning of every cycle (section 4.3.1).

    Attributes:
        cycles: heating cycles per run; each one is excitation, friction and warm-up.
        cycle_time: duration of each cycle [s].
        warm_up: duration of the warm-up in a heating cycle [s].
        warm_up_range: fraction of each joint's range that the warm-up uses.
        duties: duty cycle of the warm-up, from above 0 to 1; on the command line [%]. A list such as 20,40,60,100 plans
            one run for each value.
        cooling: number of friction stages with rest in between after each run, one per cycle time.
        power_on: time with motors on and without motion before the first run [s].
        levels: speeds of the friction stage as fractions of the velocity limits.
        plateau: longest time at each of these speeds [s].

    Raises:
        InputError: a number out of range, or one duty cycle twice.
    """

    cycles: int = 24
    cycle_time: float = 300.0
    warm_up: float = 180.0
    warm_up_range: float = RANGE_FRACTION
    duties: Annotated[tuple[float, ...], Option(name="duty", reads=read_duties, typed="100")] = (1.0,)
    cooling: int = 0
    power_on: float = 0.0
    levels: Annotated[tuple[float, ...], Option(hidden=True)] = FRICTION_LEVELS
    plateau: Annotated[float, Option(hidden=True)] = LONGEST_PLATEAU

    def __post_init__(self) -> None:
        object.__setattr__(self, "duties", tuple(float(duty) for duty in self.duties))
        object.__setattr__(self, "levels", tuple(float(level) for level in self.levels))
        for name, least in (("cycles", 0), ("cooling", 0)):
            value = getattr(self, name)
            if isinstance(value, bool) or value != int(value) or value < least:
                raise InputError(f"{name} is {value}", allowed=f"a whole number, {least} or more")
        for name in ("cycle_time", "warm_up", "plateau"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise InputError(f"{name} is {value} s", allowed="a positive time")
        if not (math.isfinite(self.power_on) and self.power_on >= 0.0):
            raise InputError(f"power_on is {self.power_on} s", allowed="zero or a positive time")
        if not 0.0 < self.warm_up_range <= 1.0:
            raise InputError(f"warm_up_range is {self.warm_up_range}", allowed="a fraction above 0 and up to 1")
        if not self.duties or not all(0.0 < duty <= 1.0 for duty in self.duties):
            raise InputError(f"duties are {list(self.duties)}", allowed="fractions above 0 and up to 1")
        if len({duty_name(duty) for duty in self.duties}) < len(self.duties):
            raise InputError(f"duties are {list(self.duties)}", allowed="each once")
        if not self.levels or not all(0.0 < level <= 1.0 for level in self.levels):
            raise InputError(f"levels are {list(self.levels)}", allowed="fractions above 0 and up to 1")
        if not (self.cycles or self.cooling or self.power_on):
            raise InputError(
                "the campaign is empty", allowed="at least one of --cycles, --cooling and --power-on above zero"
            )
        if self.cycles and self.warm_up >= self.cycle_time:
            raise InputError(
                f"a warm-up of {self.warm_up:g} s does not fit into a cycle of {self.cycle_time:g} s",
                remedy="shorten the warm-up, or lengthen the cycle",
            )
        if self.duration > LONGEST_CAMPAIGN:
            raise InputError(
                f"the campaign lasts {self.duration / 3600:.0f} h", allowed=f"{LONGEST_CAMPAIGN / 3600:.0f} h"
            )

    @property
    def runs(self) -> int:
        """How many runs of heating and cooling there are."""
        return len(self.duties) if self.cycles else min(self.cooling, 1)

    @property
    def duration(self) -> float:
        """Of the whole campaign [s]."""
        return self.power_on + self.runs * (self.cycles + self.cooling) * self.cycle_time

    @property
    def stage_names(self) -> tuple[str, ...]:
        """The distinct stages, in the order of their first appearance."""
        names = ["power_on"] if self.power_on else []
        if self.cycles:
            names.append("excitation")
        if self.cycles or self.cooling:
            names.append("friction")
        if self.cycles:
            names += [duty_name(duty) for duty in self.duties]
        return tuple(names)


def duty_name(duty: float) -> str:
    """Names the warm-up stage of a duty cycle: ``warm_up_20`` at 0.2."""
    return f"warm_up_{100.0 * duty:.4g}".replace(".", "p")
