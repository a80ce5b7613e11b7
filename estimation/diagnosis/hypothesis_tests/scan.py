"""Scan: score tests of all hypotheses at all shapes, with family-wise p-values."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TypeVar

import numpy as np
from scipy.special import gammaincc

from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Group, Problem
from estimation.diagnosis.hypothesis_tests.scoring import Accepted, score
from estimation.diagnosis.noise_models.whitening import acting
from robots.common.arrays import Array
from robots.common.forks import forked

# Longer grids are not scanned completely: the effect proposes points. The p-value still counts the whole grid.
LONG = 60
PROPOSED = 6
# Number of columns that are whitened together, and of hypotheses that a process takes at once.
WIDE, CHUNK = 32, 4

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Entry:
    """A hypothesis, evaluated at all its shapes.

    Attributes:
        hypothesis: effect and joint.
        shapes: the points scanned.
        groups: one per point.
        tries: number of points of the whole grid, for the Bonferroni correction.
        sizes: mean products of the columns relative to the joint's torque RMS (points, k, k), on the joint where they
            are largest.
    """

    hypothesis: Hypothesis
    shapes: tuple[tuple[float, ...], ...]
    groups: tuple[Group, ...]
    tries: int
    sizes: Array


@dataclass(frozen=True, eq=False)
class Outcome:
    """Result of one hypothesis in a scan.

    Attributes:
        hypothesis: effect and joint.
        shape: the best point.
        gain: chi-square explained there, with bounded coefficients.
        visible: largest share of a column's energy that the accepted model does not absorb.
        evidence: -log(p), p the p-value of the best point times the number of points tried (Bonferroni).
        degrees: number of visible directions; 0 if the log shows none.
    """

    hypothesis: Hypothesis
    shape: tuple[float, ...]
    gain: float
    visible: float
    evidence: float
    degrees: int


@dataclass(frozen=True, eq=False)
class Scan:
    """Results of all hypotheses.

    Attributes:
        outcomes: sorted by evidence, the strongest first.
    """

    outcomes: tuple[Outcome, ...]

    @cached_property
    def _tests(self) -> int:
        return sum(outcome.degrees > 0 for outcome in self.outcomes)

    def p_value(self, outcome: Outcome) -> float:
        """Returns the family-wise p-value (Bonferroni), a bound on the probability in pure noise."""
        return min(1.0, max(self._tests * math.exp(-outcome.evidence), sys.float_info.min))


def measure(
    problem: Problem, hypotheses: Sequence[Hypothesis], advance: Callable[[float], None] = lambda share: None
) -> list[Entry]:
    """Evaluates each hypothesis at each shape, whitens its columns and projects the base model out.

    Args:
        problem: data and base model.
        hypotheses: effects and joints.
        advance: is called with the share of the work done.

    Returns:
        One entry per hypothesis that the data can show.
    """
    # Those of the whole robot take longest. They come first, so that no process waits for them at the end.
    order = sorted(range(len(hypotheses)), key=lambda k: hypotheses[k].joint is not None)
    found = forked(partial(_entry, problem), [hypotheses[k] for k in order], advance, chunk=CHUNK)
    entries = dict(zip(order, found, strict=True))
    # Effects are compared by identity, and a forked process returns a copy.
    return [replace(entry, hypothesis=own) for k, own in enumerate(hypotheses) if (entry := entries[k]) is not None]


def _entry(problem: Problem, hypothesis: Hypothesis) -> Entry | None:
    joint = hypothesis.joint
    if joint is not None and problem.recording.sign_unknown[:, joint - 1].all():
        # Static friction balances any torque on a joint that rests throughout.
        return None
    situation = problem.state_for(hypothesis.effect)
    shapes = hypothesis.effect.grid(situation, joint)
    tries = len(shapes)
    if tries > LONG:
        slope = problem.score_gradient_for(hypothesis.effect)
        shapes = hypothesis.effect.propose(situation, hypothesis.joint, slope, PROPOSED)
    kept: list[tuple[float, ...]] = []
    batches: dict[tuple[int, ...], list[tuple[int, tuple[Array, ...]]]] = {}
    for shape in shapes:
        joints, columns = problem.columns_of(hypothesis, shape)
        if any(acting(part).any() for part in columns):
            batches.setdefault(joints, []).append((len(kept), columns))
            kept.append(shape)
    if not kept:
        return None
    groups: dict[int, Group] = {}
    sizes: dict[int, Array] = {}
    for joints, members in batches.items():
        # One product for many shapes is faster than one for each.
        for chunk in _chunks(members, max(1, WIDE // members[0][1][0].shape[1])):
            together = tuple(
                np.concatenate([p.T for p in parts]).T for parts in zip(*(c for _, c in chunk), strict=True)
            )
            groups.update(
                zip(
                    (at for at, _ in chunk),
                    problem.groups(joints, together, len(chunk), effect=hypothesis.effect),
                    strict=True,
                )
            )
        sizes.update((at, _size(problem, joints, columns)) for at, columns in members)
    ordered = tuple(groups[at] for at in range(len(kept)))
    return Entry(
        hypothesis=hypothesis,
        shapes=tuple(kept),
        groups=ordered,
        tries=max(tries, 1),
        sizes=np.stack([sizes[at] for at in range(len(kept))]),
    )


def _chunks(items: list[T], length: int) -> list[list[T]]:
    return [items[start : start + length] for start in range(0, len(items), length)]


def _size(problem: Problem, joints: tuple[int, ...], columns: tuple[Array, ...]) -> Array:
    best = np.zeros((columns[0].shape[1],) * 2)
    for j, part in zip(joints, columns, strict=True):
        gram = part.T @ part / (len(part) * max(float(problem.rms[j]), 1e-12) ** 2)
        if np.trace(gram) > np.trace(best):
            best = gram
    return best


def scan(problem: Problem, entries: Sequence[Entry], accepted: Accepted) -> Scan:
    """Computes the score of all entries beside the accepted groups.

    The p-value of a hypothesis is multiplied by the number of its grid points, so a fine grid is no advantage.
    """
    outcomes = [_outcome(problem, entry, accepted) for entry in entries]
    return Scan(tuple(sorted(outcomes, key=lambda o: -o.evidence)))


def _outcome(problem: Problem, entry: Entry, accepted: Accepted) -> Outcome:
    robot = problem.situation.robot
    best = Outcome(entry.hypothesis, entry.shapes[0], 0.0, 0.0, 0.0, 0)
    for shape, group in zip(entry.shapes, entry.groups, strict=True):
        result = score(problem, group, accepted)
        if not result.degrees:
            continue
        # Coefficients stay within physical bounds: a negative stiffness is not a finding.
        found = result.limited(entry.hypothesis, robot, shape)
        evidence = neg_log_p(found.gain, found.degrees) - math.log(entry.tries)
        if not best.degrees or evidence > best.evidence:
            best = Outcome(entry.hypothesis, shape, found.gain, result.visible, max(evidence, 0.0), found.degrees)
    return best


def neg_log_p(statistic: float, degrees: int) -> float:
    """Returns -log of the upper tail probability of a chi-square variable.

    Args:
        statistic: value of the variable.
        degrees: degrees of freedom.
    """
    half = statistic / 2
    p = float(gammaincc(degrees / 2, half))
    if p > 1e-290:
        return -math.log(p)
    # Near the smallest double only the leading term of the tail is used; its error is about 0.01.
    return half - (degrees / 2 - 1) * math.log(half) + math.lgamma(degrees / 2)
