"""The scan: all hypotheses at all shapes as score tests, and what noise alone would have made of the largest."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaincc, gammaln
from scipy.stats import gumbel_r

from estimation.diagnosis.hypothesis_tests.groups import Group
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.null_products import null_products
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.scoring import Accepted, score
from robots.common.memory import give_back
from robots.common.parallel import threaded

Array = NDArray[np.float64]
Small = NDArray[np.float32]

# A grid longer than this is not scanned whole: its effect proposes points, and is charged for the whole grid.
LONG = 60
PROPOSED = 6
# Mean of the Gumbel distribution: the largest of m independent -log p is log m + this, on average.
EULER = 0.5772156649015329
# Hypotheses after which what their evaluation has left of the heap is given back.
OFTEN = 20
# Columns that are whitened side by side.
WIDE = 32

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Entry:
    """A hypothesis with all its shapes measured.

    Attributes:
        hypothesis: effect and joint.
        shapes: the points scanned.
        groups: one a point.
        tries: points that the choice was made from.
        charged: whether the grid is charged whole, for all of its points, and not for what null logs make of it.
        nulls: products of each group with the null logs (points, k, draws); none where the grid is charged whole.
        sizes: mean products of each group's columns as shares of the joint's torque (points, k, k), on the joint where
            they are largest.
    """

    hypothesis: Hypothesis
    shapes: tuple[tuple[float, ...], ...]
    groups: tuple[Group, ...]
    tries: int
    charged: bool
    nulls: Small
    sizes: Array


@dataclass(frozen=True, eq=False)
class Outcome:
    """A hypothesis in one scan.

    Attributes:
        hypothesis: effect and joint.
        shape: the best point.
        gain: squared residual explained there, coefficients within their bounds.
        visible: largest share of a column's energy that the model before leaves.
        evidence: -log of the p-value of the best point, corrected for the points tried.
        degrees: directions that show; 0 where the log cannot tell.
    """

    hypothesis: Hypothesis
    shape: tuple[float, ...]
    gain: float
    visible: float
    evidence: float
    degrees: int


@dataclass(frozen=True, eq=False)
class Scan:
    """All hypotheses, the strongest first, and the null.

    Attributes:
        outcomes: sorted by evidence.
        largest: evidence of the strongest hypothesis in each null log (draws,).
    """

    outcomes: tuple[Outcome, ...]
    largest: Array

    def p_value(self, evidence: float) -> float:
        """Family-wise p-value: the chance that noise alone has a hypothesis this strong.

        Counted where the draws reach; beyond, by the Gumbel distribution fitted to them.
        """
        draws = len(self.largest)
        if not draws:
            return float("nan")
        above = int(np.sum(self.largest >= evidence))
        if above >= 10:
            return (1 + above) / (1 + draws)
        location, scale = gumbel_r.fit(self.largest)
        return float(max(gumbel_r.sf(evidence, location, scale), np.finfo(float).tiny))


def measure(
    problem: Problem, hypotheses: Sequence[Hypothesis], advance: Callable[[float], None] = lambda share: None
) -> list[Entry]:
    """Evaluates, whitens and projects the columns of every hypothesis at every shape."""
    done = 0

    def one(hypothesis: Hypothesis) -> Entry | None:
        nonlocal done
        entry = _entry(problem, hypothesis)
        done += 1
        if done % OFTEN == 0:
            give_back()
        advance(done / len(hypotheses))
        return entry

    return [entry for entry in threaded(one, hypotheses) if entry is not None]


def _entry(problem: Problem, hypothesis: Hypothesis) -> Entry | None:
    joint = hypothesis.joint
    if joint is not None and problem.recording.sign_unknown[:, joint - 1].all():
        # A joint that rests throughout: friction holds against whatever acts there.
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
        if any(part.any() for part in columns):
            batches.setdefault(joints, []).append((len(kept), columns))
            kept.append(shape)
    if not kept:
        return None
    groups: dict[int, Group] = {}
    sizes: dict[int, Array] = {}
    for joints, members in batches.items():
        # Shapes side by side: one product with the base model and one with the nulls instead of one for each.
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
    nulls = np.zeros((0, 0, 0), np.float32)
    charged = tries > LONG or any(group.high_band_columns for group in ordered)
    if not charged and problem.nulls[1].shape[1]:
        nulls = np.empty((len(kept), ordered[0].size, problem.nulls[1].shape[1]), np.float32)
        for members in batches.values():
            places = [at for at, _ in members]
            nulls[places] = null_products(problem, [groups[at] for at in places])
    return Entry(
        hypothesis=hypothesis,
        shapes=tuple(kept),
        groups=ordered,
        tries=max(tries, 1),
        charged=charged,
        nulls=nulls,
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


def scan(
    problem: Problem,
    entries: Sequence[Entry],
    accepted: Accepted,
    rng: np.random.Generator,
    *,
    nulls: bool = True,
) -> Scan:
    """Scores all entries beside what is accepted, on the data and on the null logs.

    Each hypothesis' best -log p is corrected by the number of independent points that its grid is worth, found from the
    null logs, so that a fine grid is no advantage; the largest of all in each null log gives the family-wise error.
    Without `nulls` there are no p-values.
    """
    draws = problem.nulls[1].shape[1] if nulls else 0

    def one(entry: Entry) -> tuple[Outcome, Array]:
        return _outcome(problem, entry, accepted, draws)

    results = list(threaded(one, entries))
    largest = np.zeros(draws)
    for entry, (outcome, null) in zip(entries, results, strict=True):
        if outcome.degrees:
            if entry.charged and draws:
                null = rng.exponential(size=draws)  # corrected for its grid, a p-value is uniform
            np.maximum(largest, null, out=largest)
    outcomes = sorted((outcome for outcome, _ in results), key=lambda o: -o.evidence)
    return Scan(tuple(outcomes), largest)


def _outcome(problem: Problem, entry: Entry, accepted: Accepted, draws: int) -> tuple[Outcome, Array]:
    robot = problem.situation.robot
    best: tuple[float, float, tuple[float, ...], float, int] = (-1.0, 0.0, (), 0.0, 0)
    highest: dict[int, Array] = {}
    for at, (shape, group) in enumerate(zip(entry.shapes, entry.groups, strict=True)):
        result = score(problem, group, accepted)
        if not result.degrees:
            continue
        # Within physical bounds: a gear of negative stiffness is no alarm.
        gain = result.bounded(*entry.hypothesis.coefficient_bounds(robot, shape))[0]
        evidence = float(neg_log_p(np.array(gain), result.degrees))
        if draws and not entry.charged:
            cross = entry.nulls[at] - result.onto.T @ accepted.nulls
            stats = ((result.root @ cross) ** 2).sum(axis=0)
            highest[result.degrees] = np.maximum(highest.get(result.degrees, np.zeros(draws)), stats)
        if evidence > best[0]:
            best = (evidence, gain, shape, result.visible, result.degrees)
    worst = np.zeros(draws)
    for degrees, stats in highest.items():
        np.maximum(worst, neg_log_p(stats, degrees), out=worst)
    if best[4] == 0:
        return Outcome(entry.hypothesis, entry.shapes[0], 0.0, 0.0, 0.0, 0), worst
    correction = np.log(entry.tries) if entry.charged else _tries(worst)
    null = np.maximum(worst - correction, 0.0)
    evidence = max(best[0] - correction, 0.0)
    return Outcome(entry.hypothesis, best[2], best[1], best[3], evidence, best[4]), null


def neg_log_p(statistic: Array, degrees: int) -> Array:
    """Gives -log of the chance that a chi-square variable of these degrees of freedom is as large."""
    half = np.asarray(statistic, dtype=float) / 2
    p = gammaincc(degrees / 2, half)
    with np.errstate(divide="ignore"):
        # Beyond the smallest double the tail's leading term is exact to a per cent of a unit.
        far = half - (degrees / 2 - 1) * np.log(np.maximum(half, 1e-300)) + gammaln(degrees / 2)
        return np.asarray(np.where(p > 1e-290, -np.log(np.maximum(p, 1e-300)), far))


def _tries(worst: Array) -> float:
    """Logarithm of the number of independent tests that a null maximum of -log p speaks of."""
    return max(float(worst.mean()) - EULER, 0.0) if len(worst) else 0.0
