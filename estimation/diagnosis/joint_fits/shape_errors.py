"""How well the shape of an effect is known: standard errors by the profile of the likelihood."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.calibration import MIN_BIC_GAIN
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import FittedEffect, climb
from estimation.diagnosis.hypothesis_tests.scoring import Accepted, score
from robots.common.stretches import spans

Array = NDArray[np.float64]

# Steps of a shape parameter along which its likelihood is followed: up to where it drops by this much.
DROP = 2.0
# A value at which the likelihood is less than this below its top may be the true one.
OPEN = 3.84
# A moment may be where the profile drops by less than this: (1 - e^(-x / 2))^2 is .95, the distribution of the
# likelihood ratio of a moment of change (Hansen, Econometrica 2000).
CHANGED = 7.35
# It is followed each way in growing steps, until so many in a row drop by twice as much.
FIRST, GROWING, MANY, LOST = 1.5, 1.3, 24, 3
# What lies between the last of them and the next is halved so often.
HALVINGS = 4
# Of two shapes one is followed in steps that grow by this, so often at most, the other refitted in so many evaluations.
WIDENING, FEW, REFITTED = 1.5, 10, 12
# A moment within this time [s] of rows that show no change may be anywhere in them.
BORDER = 0.05
# So much of what a drive loses at most it must lose in a row that shows none: the mean loss by noise has no end.
CUT = 0.05
# Values of a shape that is left as assumed at which the likelihood is asked.
POINTS = 21


def shape_errors(problem: Problem, member: FittedEffect, others: Accepted) -> list[float]:
    """Finds each shape parameter's standard error by its profile; infinite where the likelihood hardly drops.

    One whose bounds are equal is known, unless it is a choice and another would do about as well.
    """
    situation = problem.state_for(member.hypothesis.effect)
    bounds = member.hypothesis.effect.bounds(situation, member.hypothesis.joint)
    steps = []
    for k, (value, (low, high), shape) in enumerate(
        zip(member.shape, bounds, member.hypothesis.effect.shapes, strict=True)
    ):
        if low == high:
            steps.append(0.0 if _chosen(problem, member, k, others) else np.inf)
            continue
        best = _gain(problem, member, member.shape, others)
        room = (high - low) if np.isfinite(high - low) else max(abs(value), 1.0)
        step = 0.05 * abs(value) if shape.scale == "log" else 1e-3 * room
        found = np.inf
        for _ in range(14):
            drops = [
                best - _gain(problem, member, with_value(member.shape, k, x), others)
                for x in (value - step, value + step)
                if low <= x <= high
            ]
            if not drops:
                break
            drop = float(np.mean(drops))
            if drop >= DROP:
                found = step / np.sqrt(drop)
                if drop <= 8 * DROP:
                    break
                step *= float(np.sqrt(2 * DROP / drop))
            elif np.isfinite(found):
                break
            else:
                step *= 2.0
        if shape.unit == "s" and shape.scale == "linear" and np.isfinite(found):
            profile = partial(_drop, problem, member, k, others, best)
            found = max(found, _reach(profile, value, found, (low, high)) / 1.96)
        if value == shape.default and len(member.shape) == 1:
            found = _assumed(problem, member, others, best, (low, high)) / 1.96
        if _paired(member) and np.isfinite(found):
            found = max(found, _along_ridge(problem, member, k, others, found) / 1.96)
        steps.append(found if found <= (abs(value) if shape.scale == "log" else 0.3 * room) else np.inf)
    return steps


def _chosen(problem: Problem, member: FittedEffect, k: int, others: Accepted) -> bool:
    """Whether the data tell the only value that a shape parameter may have from others that machines have."""
    rest = [value for value in member.hypothesis.effect.shapes[k].choices if value != member.shape[k]]
    gains = [_gain(problem, member, with_value(member.shape, k, value), others) for value in rest]
    return max(gains, default=-np.inf) < _gain(problem, member, member.shape, others) - MIN_BIC_GAIN


def _assumed(
    problem: Problem, member: FittedEffect, others: Accepted, best: float, bounds: tuple[float, float]
) -> float:
    """How far a shape may be from what is assumed of it, by the likelihood's own top, which was not worth its price."""
    points = np.linspace(*bounds, POINTS)
    gains = [_gain(problem, member, (float(x),), others) for x in points]
    top = max(best, *gains)
    near = [abs(float(x) - member.shape[0]) for x, gain in zip(points, gains, strict=True) if top - gain < OPEN]
    return max(near, default=0.0)


def _drop(problem: Problem, member: FittedEffect, k: int, others: Accepted, best: float, value: float) -> float:
    """How much less is explained with another value of a shape parameter."""
    return best - _gain(problem, member, with_value(member.shape, k, value), others)


def _reach(drop: Callable[[float], float], value: float, step: float, bounds: tuple[float, float]) -> float:
    """The farthest of some points at which the moment of a change may be, by the likelihood; zero for none.

    Its profile is a random walk with a drift, not a parabola: it may have more summits, and what the top's curvature
    says of its width is little.
    """
    farthest = 0.0
    for way in (-1, 1):
        lost, inside, outside = 0, 0.0, np.inf
        for distance in step * FIRST * GROWING ** np.arange(MANY):
            x = value + way * distance
            if lost == LOST or not bounds[0] <= x <= bounds[1]:
                break
            lower = drop(x)
            lost = lost + 1 if lower > 2 * CHANGED else 0
            if lower < CHANGED:
                inside, outside = distance, np.inf
            else:
                outside = min(outside, distance)
        # Between the last point where it may be and the next one: a moment in a rest may be anywhere to its end.
        for _ in range(HALVINGS if inside and np.isfinite(outside) else 0):
            middle = (inside + outside) / 2
            inside, outside = (middle, outside) if drop(value + way * middle) < CHANGED else (inside, middle)
        farthest = max(farthest, inside)
    return float(farthest)


def _paired(member: FittedEffect) -> bool:
    """Whether its shapes are a velocity and the exponent of it, or the like: two of which neither is assumed."""
    shapes = member.hypothesis.effect.shapes
    return len(shapes) == 2 and all(s.default is None and s.lower > -np.inf for s in shapes)


def _along_ridge(problem: Problem, member: FittedEffect, k: int, others: Accepted, step: float) -> float:
    """How far one of two shapes may be, by the likelihood at its 95 % bound, the other one always refitted.

    A ridge of the likelihood is bent: neither its curvature at the top says how long it is, nor its width. The longer
    way counts.
    """
    shapes = member.hypothesis.effect.shapes
    bounds = member.hypothesis.effect.bounds(problem.state_for(member.hypothesis.effect), member.hypothesis.joint)
    other, value = 1 - k, member.shape[k]
    best: list[float] = []

    def fitted(x: float, start: float) -> tuple[float, float]:
        """The largest gain at a value of the shape, and the other one's there."""
        best[:] = [-np.inf, start]

        def gain(values: tuple[float, ...]) -> float:
            result = _gain(problem, member, with_value(with_value(member.shape, k, x), other, values[0]), others)
            if result > best[0]:
                best[:] = [result, values[0]]
            return result

        climb(gain, (start,), (bounds[other],), [shapes[other].scale], REFITTED, [None])
        return best[0], best[1]

    top, middle = fitted(value, member.shape[other])
    relative = shapes[k].scale == "log"
    farthest = 0.0
    for way in (-1, 1):
        distance, start, inner = 1.96 * step, middle, (0.0, 0.0)
        for _ in range(FEW):
            x = value * np.exp(way * distance / value) if relative else value + way * distance
            if not bounds[k][0] <= x <= bounds[k][1]:
                break
            gain, start = fitted(float(x), start)
            root = float(np.sqrt(max(top - gain, 0.0)))
            if root > np.sqrt(OPEN):
                distance = np.interp(np.sqrt(OPEN), (inner[1], root), (inner[0], distance))
                break
            inner = (distance, root)
            distance *= WIDENING
        farthest = max(farthest, float(distance))
    return farthest


def widen_change_times(
    problem: Problem, member: FittedEffect, others: Sequence[FittedEffect], errors: Sequence[float]
) -> list[float]:
    """Widens errors of moments of change, and of how long it lasts from there, beside times that show none.

    Args:
        problem: the data.
        member: whose shapes have the errors.
        others: what else was found.
        errors: by the profiles.
    """
    result, lasts = list(errors), _durations(member)
    for k in _moments(member):
        for start, stop in _hidden(problem, member, others, member.shape[k]):
            far = max(member.shape[k] - start, stop - member.shape[k])
            for i in (k, *lasts):
                result[i] = max(result[i], float(far) / 1.96)
    return result


def spread_over_pauses(problem: Problem, member: FittedEffect, others: Sequence[FittedEffect]) -> FittedEffect:
    """Puts a change that may as well have come between two logs in the middle of where it may have come."""
    moments = _moments(member)
    if len(moments) != 1 or _durations(member):
        return member
    for start, stop in _hidden(problem, member, others, member.shape[moments[0]]):
        if any(start <= last and first <= stop for last, first in _pauses(problem)):
            return replace(member, shape=with_value(member.shape, moments[0], float(start + stop) / 2))
    return member


def _moments(member: FittedEffect) -> list[int]:
    return [k for k, s in enumerate(member.hypothesis.effect.shapes) if s.moment]


def _durations(member: FittedEffect) -> list[int]:
    return [k for k, s in enumerate(member.hypothesis.effect.shapes) if s.name == "duration"]


def _pauses(problem: Problem) -> list[tuple[float, float]]:
    """Lists the times [s] between which no log was running."""
    t = problem.recording.t
    return [(float(t[start - 1]), float(t[start])) for start in problem.recording.starts[1:]]


def _hidden(
    problem: Problem, member: FittedEffect, others: Sequence[FittedEffect], moment: float
) -> list[tuple[float, float]]:
    """Lists the times [s] about a moment between which nothing shows it.

    A drive is at its limit, and its torque is all that; the joints stand; or no log was running.
    """
    t, joints = problem.recording.t, member.hypothesis.effect.acts_on(problem.situation.robot, member.hypothesis.joint)
    blind = [np.asarray(problem.recording.sign_unknown[:, list(joints)].all(axis=1))]
    for other in others:
        if other.hypothesis.effect.acts_on_total_torque and set(other.group.joints) & set(joints):
            lost = [np.abs(X).max(axis=1) for X in problem.columns_of(other.hypothesis, other.shape)[1]]
            blind.append(np.asarray(np.any([loss > CUT * loss.max() for loss in lost], axis=0)))
    found = [(float(t[start]), float(t[stop - 1])) for rows in blind for start, stop in spans(rows)]
    found += _pauses(problem)
    merged: list[tuple[float, float]] = []
    for start, stop in sorted(found):
        # A joint that waits for the log's end, and one that waits in the next: between them nothing shows either.
        if merged and start <= merged[-1][1] + problem.recording.step:
            merged[-1] = (merged[-1][0], max(merged[-1][1], stop))
        else:
            merged.append((start, stop))
    return [(a, b) for a, b in merged if b - a > BORDER and a - BORDER <= moment <= b + BORDER]


def formula_errors(problem: Problem, member: FittedEffect, coefficients: Array) -> Array:
    """Standard errors (k + s,) of coefficients (k,) and shapes that the formula adds to those of the data."""
    effect, robot = member.hypothesis.effect, problem.situation.robot
    described = zip(effect.shapes, member.shape, strict=True)
    shapes = [s.inexact * (abs(value) if s.scale == "log" else 1.0) for s, value in described]
    own = np.array([c.inexact for c in effect.parameters(robot, member.hypothesis.joint)])
    agreed = member.gain / member.birge_ratio
    if 0 < member.motion_error_chi2 < agreed:
        own = np.hypot(own, np.sqrt(1.0 / (agreed - member.motion_error_chi2) - 1.0 / agreed))
    return np.array([*(own * np.abs(coefficients)), *shapes])


def _gain(problem: Problem, member: FittedEffect, shape: tuple[float, ...], others: Accepted) -> float:
    """What is explained at a shape, by coefficients that go with it: a delay's are near that of its reversals."""
    result = score(problem, problem.measured(member.hypothesis, shape), others)
    return result.bounded(*member.hypothesis.coefficient_bounds(problem.situation.robot, shape))[0]


def with_value(shape: tuple[float, ...], k: int, value: float) -> tuple[float, ...]:
    """Gives a shape with another value of one parameter."""
    return (*shape[:k], value, *shape[k + 1 :])
