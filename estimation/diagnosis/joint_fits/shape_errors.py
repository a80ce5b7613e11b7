"""Standard errors of shape parameters from profiles of the likelihood."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from estimation.diagnosis.calibration import MIN_BIC_GAIN
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import climb
from estimation.diagnosis.hypothesis_tests.scoring import Accepted, score
from estimation.uncertainty.quantiles import CHI2_95, NORMAL_95
from robots.common.arrays import Array
from robots.common.stretches import spans
from robots.terms.effect_bases.capabilities import Reading

# Drop of the explained chi-square to which a profile is followed.
DROP = 2.0
# A value is possible if the explained chi-square there is lower by less than `CHI2_95`. For a change time:
# (1 - e^(-x / 2))^2 = 0.95, the distribution of its likelihood ratio (Hansen 2000).
CHANGED = 7.35
# Steps of its profile in each direction: the first in standard errors, their growth, their largest number, and the
# number of successive drops beyond twice that value at which it ends.
FIRST, GROWING, MANY, LOST = 1.5, 1.3, 24, 3
# Bisections between the last possible point and the next one.
HALVINGS = 4
# Two coupled shapes: growth of the steps of one, their largest number, and evaluations to refit the other.
WIDENING, FEW, REFITTED = 1.5, 10, 12
# Time [s] from a stretch without information within which a change time may be anywhere in that stretch.
BORDER = 0.05
# Share of the largest clipped torque from which a row counts as clipped. Noise makes the mean loss positive everywhere.
CUT = 0.05
# Number of values at which the profile of an assumed shape is evaluated.
POINTS = 21


def shape_errors(problem: Problem, member: FittedEffect, others: Accepted) -> list[float]:
    """Estimates the standard error of each shape parameter from its profile.

    Coefficients and base model are refitted at each value. A parameter with equal bounds has no error, unless it is a
    choice and another value fits about as well.

    Args:
        problem: data and base model.
        member: the effect.
        others: the other groups in the model.

    Returns:
        One per shape parameter; infinite if the profile hardly drops.
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
            found = max(found, _reach(profile, value, found, (low, high)) / NORMAL_95)
        if value == shape.default and len(member.shape) == 1:
            found = _assumed(problem, member, others, best, (low, high)) / NORMAL_95
        if _paired(member) and np.isfinite(found):
            found = max(found, _along_ridge(problem, member, k, others, found) / NORMAL_95)
        steps.append(found if found <= (abs(value) if shape.scale == "log" else 0.3 * room) else np.inf)
    return steps


def _chosen(problem: Problem, member: FittedEffect, k: int, others: Accepted) -> bool:
    """Whether the data reject all other values of a shape parameter with few choices."""
    rest = [value for value in member.hypothesis.effect.choices(problem.situation.robot, k) if value != member.shape[k]]
    gains = [_gain(problem, member, with_value(member.shape, k, value), others) for value in rest]
    return max(gains, default=-np.inf) < _gain(problem, member, member.shape, others) - MIN_BIC_GAIN


def _assumed(
    problem: Problem, member: FittedEffect, others: Accepted, best: float, bounds: tuple[float, float]
) -> float:
    """Returns the largest distance of possible values from an assumed one, by the maximum of the profile."""
    points = np.linspace(*bounds, POINTS)
    gains = [_gain(problem, member, (float(x),), others) for x in points]
    top = max(best, *gains)
    near = [abs(float(x) - member.shape[0]) for x, gain in zip(points, gains, strict=True) if top - gain < CHI2_95]
    return max(near, default=0.0)


def _drop(problem: Problem, member: FittedEffect, k: int, others: Accepted, best: float, value: float) -> float:
    """Returns the decrease of the explained chi-square at another value of a shape parameter."""
    return best - _gain(problem, member, with_value(member.shape, k, value), others)


def _reach(drop: Callable[[float], float], value: float, step: float, bounds: tuple[float, float]) -> float:
    """Returns the largest distance of possible change times; zero if there is none.

    The profile is a random walk with drift and may have several maxima. Its curvature says little about its width.
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
        # A change during a rest may be anywhere up to its end.
        for _ in range(HALVINGS if inside and np.isfinite(outside) else 0):
            middle = (inside + outside) / 2
            inside, outside = (middle, outside) if drop(value + way * middle) < CHANGED else (inside, middle)
        farthest = max(farthest, inside)
    return float(farthest)


def _paired(member: FittedEffect) -> bool:
    """Whether it has two coupled shape parameters without defaults, such as a velocity and an exponent."""
    shapes = member.hypothesis.effect.shapes
    return len(shapes) == 2 and all(s.default is None and s.lower > -np.inf for s in shapes)


def _along_ridge(problem: Problem, member: FittedEffect, k: int, others: Accepted, step: float) -> float:
    """Returns the largest distance of possible values of one of two shapes, with the other one refitted.

    The likelihood has a curved ridge, whose length follows neither from curvature nor width at the maximum.
    """
    shapes = member.hypothesis.effect.shapes
    bounds = member.hypothesis.effect.bounds(problem.state_for(member.hypothesis.effect), member.hypothesis.joint)
    other, value = 1 - k, member.shape[k]
    best: list[float] = []

    def fitted(x: float, start: float) -> tuple[float, float]:
        """Returns the largest chi-square at a value of shape k, and the other shape's value there."""
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
        distance, start, inner = NORMAL_95 * step, middle, (0.0, 0.0)
        for _ in range(FEW):
            x = value * np.exp(way * distance / value) if relative else value + way * distance
            if not bounds[k][0] <= x <= bounds[k][1]:
                break
            gain, start = fitted(float(x), start)
            root = float(np.sqrt(max(top - gain, 0.0)))
            if root > NORMAL_95:
                distance = np.interp(NORMAL_95, (inner[1], root), (inner[0], distance))
                break
            inner = (distance, root)
            distance *= WIDENING
        farthest = max(farthest, float(distance))
    return farthest


def widen_change_times(
    problem: Problem, member: FittedEffect, others: Sequence[FittedEffect], errors: Sequence[float]
) -> list[float]:
    """Increases the errors of change times and durations near stretches in which a change is invisible.

    Args:
        problem: data and base model.
        member: the effect.
        others: other effects found.
        errors: standard errors of its shape parameters.

    Returns:
        The errors (s,).
    """
    result, lasts = list(errors), _durations(member)
    for k in _moments(member):
        for start, stop in _hidden(problem, member, others, member.shape[k]):
            far = max(member.shape[k] - start, stop - member.shape[k])
            for i in (k, *lasts):
                result[i] = max(result[i], float(far) / NORMAL_95)
    return result


def spread_over_pauses(problem: Problem, member: FittedEffect, others: Sequence[FittedEffect]) -> FittedEffect:
    """Moves a change time near a pause between logs to the middle of the stretch in which it may be.

    Args:
        problem: data and base model.
        member: the effect; unchanged unless it has exactly one change time and no duration.
        others: other effects found.
    """
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
    """Lists the pauses between logs [s]."""
    t = problem.recording.t
    return [(float(t[start - 1]), float(t[start])) for start in problem.recording.starts[1:]]


def _hidden(
    problem: Problem, member: FittedEffect, others: Sequence[FittedEffect], moment: float
) -> list[tuple[float, float]]:
    """Lists the stretches [s] about a change time without visible changes: drive at its limit, rest, or no log."""
    t, joints = problem.recording.t, member.hypothesis.effect.acts_on(problem.situation.robot, member.hypothesis.joint)
    blind = [np.asarray(problem.recording.sign_unknown[:, list(joints)].all(axis=1))]
    for other in others:
        if other.hypothesis.effect.reading is Reading.CUTS and set(other.group.joints) & set(joints):
            lost = [np.abs(X).max(axis=1) for X in problem.columns_of(other.hypothesis, other.shape)[1]]
            blind.append(np.asarray(np.any([loss > CUT * loss.max() for loss in lost], axis=0)))
    found = [(float(t[start]), float(t[stop - 1])) for rows in blind for start, stop in spans(rows)]
    found += _pauses(problem)
    merged: list[tuple[float, float]] = []
    for start, stop in sorted(found):
        # A rest at the end of a log and one at the start of the next are connected by the pause.
        if merged and start <= merged[-1][1] + problem.recording.step:
            merged[-1] = (merged[-1][0], max(merged[-1][1], stop))
        else:
            merged.append((start, stop))
    return [(a, b) for a, b in merged if b - a > BORDER and a - BORDER <= moment <= b + BORDER]


def formula_errors(problem: Problem, member: FittedEffect, coefficients: Array) -> Array:
    """Returns the standard errors (k + s,) due to errors of the formula and of the motion.

    Args:
        problem: data and base model.
        member: the effect.
        coefficients: its coefficients (k,).
    """
    effect, robot = member.hypothesis.effect, problem.situation.robot
    described = zip(effect.shapes, member.shape, strict=True)
    shapes = [s.inexact * (abs(value) if s.scale == "log" else 1.0) for s, value in described]
    own = np.array([c.inexact for c in effect.parameters(robot, member.hypothesis.joint)])
    agreed = member.gain / member.birge_ratio
    if 0 < member.motion_error_chi2 < agreed:
        own = np.hypot(own, np.sqrt(1.0 / (agreed - member.motion_error_chi2) - 1.0 / agreed))
    return np.array([*(own * np.abs(coefficients)), *shapes])


def _gain(problem: Problem, member: FittedEffect, shape: tuple[float, ...], others: Accepted) -> float:
    """Returns the chi-square explained at a shape, with coefficients within the bounds for that shape."""
    result = score(problem, problem.measured(member.hypothesis, shape), others)
    return result.limited(member.hypothesis, problem.situation.robot, shape).gain


def with_value(shape: tuple[float, ...], k: int, value: float) -> tuple[float, ...]:
    """Returns a shape with parameter k replaced."""
    return (*shape[:k], value, *shape[k + 1 :])
