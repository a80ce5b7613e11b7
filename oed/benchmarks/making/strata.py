"""What the cases hide: nothing, one effect, two, or one outside the catalogue."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from oed.benchmarks.truth.effects import KNOWN, UNLISTED
from oed.benchmarks.truth.effects.base import Effect

Member = TypeVar("Member")

SHARES = {"nothing": 0.3, "one": 0.3, "two": 0.2, "outside": 0.2}
"""Shares of the cases, by stratum."""

PAIRED_SIZE = 3.0
"""Size of each of two effects over the size of a single one: two are harder to separate."""


@dataclass(frozen=True, kw_only=True)
class Task:
    """One case to draw.

    Attributes:
        number: of the case, from 1.
        stratum: a key of `SHARES`.
        seed: of everything random in it.
        effects: classes of single effects, to be tried in turn; empty for nothing and for pairs.
        robots: kinds of robots, to be tried in turn.
    """

    number: int
    stratum: str
    seed: int
    effects: tuple[type[Effect], ...]
    robots: tuple[str, ...]


def counts(cases: int) -> dict[str, int]:
    """Distributes cases over the strata by their shares, largest remainders first.

    Args:
        cases: the number of cases, at least 1.
    """
    exact = {name: share * cases for name, share in SHARES.items()}
    found = {name: int(value) for name, value in exact.items()}
    # Ties go to the stratum that comes first: two cases are one without an effect and one with one.
    order = sorted(exact, key=lambda name: found[name] - exact[name])
    for name in order[: cases - sum(found.values())]:
        found[name] += 1
    return found


def tasks(cases: int, robots: Sequence[str], rng: np.random.Generator) -> Iterator[Task]:
    """Lists cases in random order. Effects and robots take turns, so that each occurs about equally often.

    Args:
        cases: the number of cases.
        robots: kinds of robots.
        rng: random numbers.
    """
    strata = [name for name, count in counts(cases).items() for _ in range(count)]
    rng.shuffle(strata)
    seeds = rng.integers(2**62, size=cases)
    pools = {"one": _shuffled(KNOWN, rng), "outside": _shuffled(UNLISTED, rng)}
    machines = _shuffled(tuple(robots), rng)
    used = dict.fromkeys(SHARES, 0)
    for number, (stratum, seed) in enumerate(zip(strata, seeds, strict=True), start=1):
        turn = used[stratum]
        used[stratum] += 1
        yield Task(
            number=number,
            stratum=stratum,
            seed=int(seed),
            effects=_from(pools.get(stratum, ()), turn),
            robots=_from(machines, turn),
        )


def _shuffled(members: tuple[Member, ...], rng: np.random.Generator) -> tuple[Member, ...]:
    return tuple(members[k] for k in rng.permutation(len(members)))


def _from(members: tuple[Member, ...], turn: int) -> tuple[Member, ...]:
    """Returns the members in turn, beginning with that of a number."""
    first = turn % len(members) if members else 0
    return (*members[first:], *members[:first])
