"""The verdict: is the cause named, are rivals left, or does the catalogue not hold it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimation.diagnosis.problem import Problem, accept
from estimation.diagnosis.refinement import Member, refine
from estimation.diagnosis.scan import Entry, scan
from estimation.diagnosis.selection import Found, Selection

# Named effects that explain less than this share of what stands out of the noise do not explain it.
ENOUGH = 0.7
# Rivals within this of the best BIC stay possible.
CLOSE = 10.0
MOST_PATTERNS = 3
# A pattern beside named effects counts when it explains this share of what they do: formulas are true to some per cent.
BEYOND = 0.05
# A pattern is a flexible thing: it must be worth its parameters by this much (Schwarz), strong evidence.
LEAST = 10.0


@dataclass(frozen=True, eq=False)
class Judgement:
    """What stays beside the effects found.

    Attributes:
        verdict: ``none``, ``named``, ``ambiguous`` or ``unexplained``.
        patterns: functions of the motion that explain the rest, each measured beside all before.
        p_values: of the patterns.
        explained: share of what stands out of the noise that the named effects explain.
    """

    verdict: str
    patterns: tuple[Member, ...]
    p_values: tuple[float, ...]
    explained: float


def judge(
    problem: Problem,
    selection: Selection,
    patterns: Sequence[Entry],
    false_alarm: float,
    rng: np.random.Generator,
) -> Judgement:
    """Looks for functions of the motion in what the named effects leave, and weighs the two against each other."""
    named = [found.member for found in selection.found]
    members, p_values = _patterns(problem, patterns, named, false_alarm, rng)
    left = sum(max(member.gain - member.degrees, 0.0) for member in members)
    explained = selection.accepted.gain
    share = explained / (explained + left) if explained + left > 0 else 1.0
    if members and share < ENOUGH:
        verdict = "unexplained"
    elif not named:
        verdict = "none"
    elif any(is_open(found) for found in selection.found):
        verdict = "ambiguous"
    else:
        verdict = "named"
    if verdict != "unexplained":
        members, p_values = [], []
    elif named:
        # Names that do not fit would only distort the patterns: those start anew, beside the base model alone.
        members, p_values = _patterns(problem, patterns, [], false_alarm, rng)
    return Judgement(verdict, tuple(members), tuple(p_values), float(share))


def is_open(found: Found) -> bool:
    """Whether an effect has rivals that fit about as well; one that robots seldom have does not count alone."""
    return any(worse < CLOSE and not rival.hypothesis.effect.rare for rival, worse in found.rivals)


def _patterns(
    problem: Problem,
    patterns: Sequence[Entry],
    named: Sequence[Member],
    false_alarm: float,
    rng: np.random.Generator,
) -> tuple[list[Member], list[float]]:
    """Adds patterns beside named effects, while the strongest is significant and worth it."""
    members: list[Member] = []
    p_values: list[float] = []
    while len(members) < MOST_PATTERNS:
        accepted = accept(problem, tuple(m.group for m in (*named, *members)))
        result = scan(problem, patterns, accepted, rng)
        if not result.outcomes:
            break
        best = result.outcomes[0]
        p = result.p_value(best.evidence)
        if not p <= false_alarm:
            break
        member = refine(problem, best.hypothesis, best.shape, accepted)
        worth = member.gain - member.degrees
        if member.bic(problem.rows) < LEAST or worth < BEYOND * sum(m.gain for m in (*named, *members)):
            break
        members.append(member)
        p_values.append(p)
    return members, p_values
