"""Continuous refinement of an effect's shape, with its coefficients and the base model refitted at each step."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from scipy.optimize import minimize

from estimation.diagnosis.calibration import ABSENT_CHI2, MAX_REVERSAL_CHI2, REVERSAL_FORMULA_ERROR
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect, accept_all_but
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.joint_agreement import per_joint_evidence
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.scoring import Accepted, score
from robots.common.arrays import Array
from robots.terms.effect_bases.capabilities import AtReversals, Reading

# Evaluations per shape parameter.
EFFORT = 20
# Change times: points of each successive search and their reach in spacings of the search before. WIDE is added, as a
# sudden change has a narrow optimum within a broad one. AGAIN: first simplex step then, per grid spacing.
ZOOMS, AGAIN = ((21, 1.2), (11, 1.2), (11, 1.2)), 0.1
WIDE = (101, 6.0)
# First step of the simplex search: a factor for logarithmic parameters, a share of the range for others.
FACTOR, SHARE = 1.5, 0.04
# A presliding travel at its lower bound, within this factor, is a sudden sign change. It may be a delay instead.
SHORT_TRAVEL_FACTOR = 1.05


def refine(
    problem: Problem,
    hypothesis: Hypothesis,
    start: tuple[float, ...],
    accepted: Accepted,
    *,
    effort: int = EFFORT,
    others: bool = True,
) -> FittedEffect:
    """Searches the shape with the best BIC of an effect, starting from the values `start`.

    Coefficients and base model are projected out at each step (variable projection, Golub and Pereyra 1973), so only
    shape parameters are searched. Usual design values near the optimum are tried last; they do not count as fitted.
    `effort` is the number of evaluations per parameter; 0 evaluates only the start. `others`: whether other optima are
    searched, too.
    """
    situation = problem.state_for(hypothesis.effect)
    bounds = hypothesis.effect.bounds(situation, hypothesis.joint)
    scales = [shape.scale for shape in hypothesis.effect.shapes]
    loose = [k for k, (low, high) in enumerate(bounds) if high > low]
    # A choice beside the usual one counts, such as a link in place of the flange.
    chosen = [k for k, shape in enumerate(hypothesis.effect.shapes) if shape.beside and k not in loose]
    moments = [shape.moment for shape in hypothesis.effect.shapes]
    best: list[FittedEffect] = []

    def picked(shape: tuple[float, ...]) -> int:
        return sum(not hypothesis.effect.shapes[k].is_left(shape[k]) for k in chosen if k < len(shape))

    @cache
    def usual_degrees(shape: tuple[float, ...]) -> int:
        """A choice that shows fewer coefficients than the usual one is not simpler for that."""
        result = score(problem, problem.measured(hypothesis, shape), accepted)
        return result.limited(hypothesis, situation.robot, shape).degrees

    def evaluate(shape: tuple[float, ...], fitted: int | None = None) -> float:
        if fitted is None:
            fitted = sum(not hypothesis.effect.shapes[k].is_left(shape[k]) for k in loose) + picked(shape)
        group = problem.measured(hypothesis, shape)
        result = score(problem, group, accepted)
        found = result.limited(hypothesis, situation.robot, shape)
        degrees = found.degrees
        if picked(shape):
            usual = [start[k] if moments[k] else value for k, value in enumerate(shape)]
            for k in chosen:
                usual[k] = float(hypothesis.effect.shapes[k].default or 0.0)
            degrees = max(degrees, usual_degrees(tuple(usual)))
        member = FittedEffect(
            hypothesis, shape, group, found.gain, found.coefficients, degrees + fitted, result.visible
        )
        worth = member.bic_gain
        if not best or worth > best[0].bic_gain:
            best[:] = [member]
        # The search maximises the gain. The BIC has a step where an optional parameter begins to count.
        return found.gain

    def search(free: list[int], start: tuple[float, ...]) -> None:
        at = list(start)
        steps = {k: _spacing(hypothesis.effect.grid(situation, hypothesis.joint), k, start) for k in free if moments[k]}

        def along(values: tuple[float, ...]) -> float:
            for k, value in zip(free, values, strict=True):
                at[k] = value
            return evaluate(tuple(at))

        for k, step in steps.items():
            sudden = len(free) == 1
            looks = (ZOOMS[0], WIDE, *ZOOMS[1:]) if sudden else ZOOMS
            _zoom(lambda value, k=k: evaluate((*at[:k], value, *at[k + 1 :])), at[k], step, bounds[k], looks)  # type: ignore[misc]
            at[:] = best[0].shape
        if len(steps) < len(free):
            first = [AGAIN * steps[k] if k in steps else None for k in free]
            limits, kinds = tuple(bounds[k] for k in free), [scales[k] for k in free]
            climb(along, tuple(at[k] for k in free), limits, kinds, effort, first)
            summit = best[0]
            optima = hypothesis.effect.other_optima(situation, hypothesis.joint, summit.shape, summit.coefficients)
            for slopes in optima if others else ():
                gains = [evaluate(slope) for slope in slopes]
                at[:] = slopes[int(np.argmax(gains))]
                climb(along, tuple(at[k] for k in free), limits, kinds, effort, first)

    if hypothesis.effect.reading is Reading.CUTS or hypothesis.effect.reading is Reading.DISTORTS:
        # The bounds may have changed since the start was found.
        start = clip_shape(start, bounds)
    evaluate(start)
    if loose and effort:
        # Optional parameters are searched last, from the optimum of the others.
        later = [k for k in loose if hypothesis.effect.shapes[k].is_left(start[k])]
        search([k for k in loose if k not in later], start)
        if later:
            search(loose, best[0].shape)
    if effort:
        refined = best[0]
        for known in hypothesis.effect.likely(situation, hypothesis.joint, refined.shape, refined.coefficients):
            shape = tuple(own if value is None else value for value, own in zip(known, refined.shape, strict=True))
            evaluate(shape, sum(known[k] is None for k in loose) + picked(shape))
    found = best[0]
    if hypothesis.effect.at_reversals is AtReversals.LATE:
        return _with_scatter(problem, found, accepted)
    if hypothesis.effect.at_reversals is AtReversals.GRADUAL and hypothesis.joint is not None:
        too_short = found.shape[0] < SHORT_TRAVEL_FACTOR * bounds[0][0]
        return replace(found, birge_ratio=np.inf) if too_short else found
    return (
        replace(found, birge_ratio=_reversal_scatter(problem, found, accepted))
        if hypothesis.effect.at_reversals is AtReversals.IMPACT
        else found
    )


def refine_member(problem: Problem, members: Sequence[FittedEffect], i: int) -> FittedEffect:
    """Refines one of the members beside the others, starting from its shape."""
    return refine(problem, members[i].hypothesis, members[i].shape, accept_all_but(problem, members, i))


def clip_shape(shape: Sequence[float], bounds: Sequence[tuple[float, float]]) -> tuple[float, ...]:
    """Limits each shape value to its bounds."""
    return tuple(min(max(value, low), high) for value, (low, high) in zip(shape, bounds, strict=True))


def _with_scatter(problem: Problem, member: FittedEffect, accepted: Accepted) -> FittedEffect:
    """Sets the Birge ratio from the scatter of the joints' estimates, and the chi-square of reversal time errors."""
    evidence = per_joint_evidence(problem, member.hypothesis, member.shape, accepted)
    if not (acts := evidence.gram > 0).any():
        return member
    evidence = evidence.subset(acts)
    agreed = evidence.gain()
    scatter = max(1.0, float(evidence.cross.sum() ** 2 / evidence.gram.sum()) / agreed)
    return replace(member, birge_ratio=scatter, motion_error_chi2=max(0.0, agreed - evidence.gain(surely=True)))


def _reversal_scatter(problem: Problem, member: FittedEffect, accepted: Accepted) -> float:
    """Compares an effect's size near reversals with its size elsewhere; returns the Birge ratio.

    Accelerations miss part of their jumps at reversals, alike at each. On all joints this resembles an effect of
    acceleration changes. The ratio is infinite if the data contradict the effect elsewhere.
    """
    parts = score(problem, problem.split(member.group, member.coefficients, problem.far_from_reversals), accepted)
    # Expected products of both parts with the residual at the fitted size. The base model's projection couples them.
    expected = parts.gram.sum(axis=1)
    if (expected <= 0).any():
        return 1.0
    sizes = parts.cross / expected
    if (1.0 - 2.0 * sizes[0]) / (parts.gram[0, 0] / expected[0] ** 2 + REVERSAL_FORMULA_ERROR**2) > ABSENT_CHI2:
        return np.inf
    difference = np.array([1.0, -1.0]) / expected
    return max(
        1.0,
        float((sizes[0] - sizes[1]) ** 2 / (difference @ parts.gram @ difference + REVERSAL_FORMULA_ERROR**2))
        / MAX_REVERSAL_CHI2,
    )


def _spacing(grid: Sequence[tuple[float, ...]], k: int, start: tuple[float, ...]) -> float:
    """Returns the larger distance of a change time to its two neighbours on the grid, other values being equal."""
    near = [abs(point[k] - start[k]) for point in grid if point[:k] + point[k + 1 :] == start[:k] + start[k + 1 :]]
    near = sorted(distance for distance in near if distance > 0)
    return near[min(1, len(near) - 1)] if near else 1.0


def _zoom(
    evaluate: Callable[[float], float],
    start: float,
    width: float,
    bounds: tuple[float, float],
    looks: Sequence[tuple[int, float]],
) -> None:
    """Searches a change time on successively finer points: its profile is a random walk with many local optima."""
    for count, reach in looks:
        points = np.clip(start + width * np.linspace(-reach, reach, count), *bounds)
        gains = [evaluate(float(point)) for point in points]
        start, width = float(points[int(np.argmax(gains))]), 2 * reach * width / (count - 1)


def climb(
    evaluate: Callable[[tuple[float, ...]], float],
    start: tuple[float, ...],
    bounds: tuple[tuple[float, float], ...],
    scales: Sequence[str],
    effort: int,
    first: Sequence[float | None],
) -> None:
    """Maximises `evaluate` by the Nelder-Mead simplex method, on logarithms for ``log`` scales.

    `effort` is the number of evaluations per parameter; `first` is its first step, None for the default.
    """
    logs = [scale == "log" and low > 0 for scale, (low, _) in zip(scales, bounds, strict=True)]

    def forward(values: tuple[float, ...]) -> Array:
        return np.array([np.log(v) if is_log else v for v, is_log in zip(values, logs, strict=True)])

    low, high = forward(tuple(b[0] for b in bounds)), forward(tuple(b[1] for b in bounds))
    x0 = np.clip(forward(start), low, high)
    span = np.where(np.isfinite(high - low), high - low, 1.0)
    step = np.where(logs, np.minimum(np.log(FACTOR), 0.2 * span), SHARE * span)
    step = np.array([own if given is None else given for own, given in zip(step, first, strict=True)])
    simplex = np.vstack(
        [x0, *(x0 + np.where(x0[i] + step[i] > high[i], -1, 1) * step * unit for i, unit in enumerate(np.eye(len(x0))))]
    )

    def objective(x: Array) -> float:
        inside = np.clip(x, low, high)
        shape = tuple(float(np.exp(v)) if is_log else float(v) for v, is_log in zip(inside, logs, strict=True))
        return -evaluate(shape)

    minimize(
        objective,
        x0,
        method="Nelder-Mead",
        options={
            "initial_simplex": simplex,
            "maxfev": effort * len(x0),
            "xatol": 1e-3 * float(step.min()),
            "fatol": 1e-2,
        },
    )
