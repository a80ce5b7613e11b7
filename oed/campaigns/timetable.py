"""Schedule of a campaign."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from oed.campaigns.programme import Programme, duty_name
from robots.common.errors import InputError
from robots.common.records import Record

PHASES = ("power_on", "heating", "cooling")


@dataclass(frozen=True, kw_only=True)
class Slot(Record):
    """A line of the timetable.

    Args:
        start: when it starts, on the campaign's clock [s].
        end: when it ends [s].
        stage: the stage that is played; None where the robot rests at home and nothing is played.
        cycle: its cycle, counted from 1 over the whole campaign.
        run: its run, counted from 1; 0 for the power-on test.
        phase: one of `PHASES`.
        duty: duty cycle of the run's warm-up; None outside of heating.
    """

    ENTRIES = ("*", "file")

    start: float
    end: float
    stage: str | None
    cycle: int
    run: int
    phase: str
    duty: float | None = None

    @property
    def file(self) -> str | None:
        """The file to play; None for a rest."""
        return None if self.stage is None else f"{self.stage}.csv"

    @property
    def duration(self) -> float:
        """How long it takes [s]."""
        return self.end - self.start


def make_timetable(programme: Programme, samples: Mapping[str, int], period: float) -> tuple[Slot, ...]:
    """Lays the stages on one clock.

    A file of N samples takes N periods, so that files can be played one right after the other.

    Args:
        programme: what is to be run.
        samples: how many samples each stage has, by name.
        period: the controller's period [s].

    Returns:
        The lines, in order and without gaps.

    Raises:
        InputError: a cycle that its stages do not fit into, or times that are no multiples of the period.
    """
    whole = _count(programme.cycle_time, period, "the cycle time")
    slots: list[Slot] = []
    now = cycle = 0

    def add(names: list[str], length: int, **fixed: Any) -> None:
        nonlocal now, cycle
        cycle += 1
        ends = [now]
        for name in names:
            ends.append(ends[-1] + samples[name])
        left = now + length - ends[-1]
        if left < 0:
            raise InputError(
                f"{', '.join(names)} take {(length - left) * period:.4g} s, more than the cycle of "
                f"{length * period:.4g} s"
            )
        stages: list[str | None] = [*names]
        if left:
            ends.append(now + length)
            stages.append(None)
        slots.extend(
            Slot(start=start * period, end=end * period, stage=stage, cycle=cycle, **fixed)
            for stage, (start, end) in zip(stages, pairwise(ends), strict=True)
        )
        now += length

    if programme.power_on:
        for _ in range(round(programme.power_on / (samples["power_on"] * period))):
            add(["power_on"], samples["power_on"], run=0, phase="power_on")
    for run in range(programme.runs):
        duty = programme.duties[run]
        for _ in range(programme.cycles):
            add(["excitation", "friction", duty_name(duty)], whole, run=run + 1, phase="heating", duty=duty)
        for _ in range(programme.cooling):
            add(["friction"], whole, run=run + 1, phase="cooling")
    return tuple(slots)


def _count(duration: float, period: float, name: str) -> int:
    count = round(duration / period)
    if abs(count * period - duration) > 1e-6 * period:
        raise InputError(f"{name} of {duration:.9g} s is not a multiple of the controller's period of {period:g} s")
    return count
