"""What the benchmark hides: its strata, how many cases of each, and their seeds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from oed.benchmarks.truth.cases import Case, Hidden, draw_case
from oed.benchmarks.truth.effects import KNOWN, UNLISTED
from oed.benchmarks.truth.effects.base import Effect
from oed.benchmarks.truth.kinds import KINDS

TUNING = 1000
"""Seeds below this one are the benchmark's: no threshold may be tuned on them."""


@dataclass(frozen=True)
class Stratum:
    """A kind of case: how many the full benchmark has, how many effects each hides, and their visible size.

    `moves`: point to point with pauses between, instead of motion throughout. `drives`: whether the robot's description
    states gear ratios and rotor inertias, which a URDF cannot. `memory`: of the noise's coloured half, from one sample
    to the next: up to .95 it is over in .1 s, with .995 it wanders for a second.
    """

    name: str
    count: int
    hidden: int
    size: float
    strange: bool = False
    durations: tuple[float, ...] = (60.0,)
    moves: bool = False
    drives: bool = True
    memory: tuple[float, float] = (0.7, 0.95)


# Most as short as a log may be, some up to four minutes.
LENGTHS = (60.0, 60.0, 120.0, 240.0)
SLOW = (0.95, 0.995)

STRATA: dict[str, Stratum] = {
    stratum.name: stratum
    for stratum in (
        Stratum("none", 300, 0, 0.0, durations=LENGTHS),
        Stratum("half", 220, 1, 0.005, durations=LENGTHS),
        Stratum("one", 220, 1, 0.01, durations=LENGTHS),
        Stratum("two", 100, 2, 0.03, durations=LENGTHS),
        Stratum("stranger", 100, 1, 0.01, strange=True, durations=LENGTHS),
        Stratum("idle_moves", 100, 0, 0.0, moves=True),
        Stratum("moves", 100, 1, 0.01, moves=True),
        Stratum("bare", 100, 1, 0.01, drives=False),
        # So short and so little that several causes are left more often: what the one experiment resolves.
        Stratum("brief", 100, 1, 0.005, durations=(15.0,)),
        Stratum("slow_none", 100, 0, 0.0, memory=SLOW),
        Stratum("slow", 100, 1, 0.01, memory=SLOW),
    )
}


@dataclass(frozen=True)
class Task:
    """One case of one stratum."""

    stratum: str
    seed: int

    @property
    def key(self) -> str:
        """Its name in the file of results."""
        return f"{self.stratum}-{self.seed}"


def tasks(strata: list[str], share: float, first: int) -> Iterator[Task]:
    """Lists cases, the strata in turn so that a stopped run holds some of each.

    Args:
        strata: names of strata.
        share: of the full counts.
        first: the first seed: 0 for the benchmark, `TUNING` or more to tune.
    """
    counts = {name: max(1, round(STRATA[name].count * share)) for name in strata}
    for k in range(max(counts.values())):
        for name in strata:
            if k < counts[name]:
                yield Task(name, first + k)


def draw(task: Task) -> Case | None:
    """Draws a task's case; None when no robot shows its effect at the size.

    Single effects take turns, so that each is hidden equally often; the robot is the first that shows it.
    """
    stratum = STRATA[task.stratum]
    stream = 1 + list(STRATA).index(task.stratum)
    options = {"size": stratum.size, "periodic": task.seed % 2 == 0, "stream": stream, "moves": stratum.moves}
    options["noise_memory"] = stratum.memory
    # Robots take turns faster than lengths do: each has logs of every length.
    duration = stratum.durations[task.seed // (2 * len(KINDS)) % len(stratum.durations)]
    kinds = [KINDS[(task.seed // 2 + k) % len(KINDS)] for k in range(len(KINDS))]
    pool: tuple[type[Effect], ...] = UNLISTED if stratum.strange else KNOWN
    hide: list[type[Effect]] | int = stratum.hidden
    if stratum.hidden == 1:
        # Each effect is met by robots of all kinds, in periodic and in other motion.
        turn = task.seed % len(pool)
        hide = [pool[turn]]
        options["periodic"] = (task.seed + task.seed // len(pool)) % 2 == 0
    for kind in kinds:
        try:
            return draw_case(task.seed, hide=hide, kind=kind, duration=duration, unseen=30.0, **options)  # type: ignore[arg-type]
        except Hidden:
            continue
    return None
