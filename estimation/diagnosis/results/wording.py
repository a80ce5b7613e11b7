"""Findings from fitted effects: parameters with intervals, rivals, gain and a sentence."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.calibration import MAX_RELATIVE_ERROR, MAX_TIME_ERROR
from estimation.diagnosis.findings import Finding, Gain, Parameter
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.joint_fits.extended_fit import ExtendedFit
from estimation.diagnosis.recordings.recording import Recording
from estimation.diagnosis.searches.selection import SelectedEffect
from estimation.uncertainty.quantiles import NORMAL_95
from robots.robot import Robot
from robots.terms.base import force_unit, length_unit
from robots.terms.discrepancies.patterns import PREFIX
from robots.terms.effect_bases.base import Coefficient, Effect, Shape
from robots.terms.effects import EFFECTS

# Share of an effect's largest coefficient that counts as zero.
NOTHING = 1e-6


def word_finding(
    robot: Robot,
    problem: Problem,
    member: FittedEffect,
    fitted: ExtendedFit,
    i: int,
    p_value: float,
    found: SelectedEffect | None,
    gain: Gain,
) -> Finding:
    """Builds the finding of one effect of the extended model.

    Args:
        robot: robot of the logs.
        problem: data of the fit.
        member: the effect.
        fitted: fit of the extended model that contains the effect.
        i: index of the effect in this fit.
        p_value: p-value of the effect.
        found: the selected effect with its rivals; None for a free function.
        gain: gain on held-out data.

    Returns:
        The finding.
    """
    extension, known = fitted.model.extensions[i], fitted.effects[i]
    hypothesis = member.hypothesis
    joint = hypothesis.joint
    units = {}
    if joint is not None:
        units = {"force": force_unit(robot, joint - 1), "length": length_unit(robot, joint - 1)}
    parameters = _within_logs(problem.recording, _parameters(robot, member, fitted, i, known), hypothesis.effect)
    sentence = hypothesis.effect.describe(joint, extension.coefficients, extension.shape, **units)
    sentence, between = _between_logs(problem.recording, sentence, parameters)
    sentence += "" if between else _uncertain_times(parameters)
    if hypothesis.effect.undetermined_text and not known[: len(extension.coefficients)].any():
        sentence = hypothesis.effect.undetermined_text.format(joint=joint)
    pattern = hypothesis.name if hypothesis.name.startswith(PREFIX) else ""
    rivals = [] if found is None else [(rival.hypothesis, worse) for rival, worse in found.rivals]
    return Finding(
        effect="unexplained" if pattern else hypothesis.name,
        joint=joint,
        parameters=parameters,
        p_value=p_value,
        delta_bic=member.local_bic_gain,
        gain=gain,
        rivals=tuple(
            (h.name if h.joint in (joint, None) else f"{h.name} of joint {h.joint}", float(worse))
            for h, worse in rivals
        ),
        sentence=sentence,
        visible=member.visible,
        coordinate=hypothesis.effect.coordinate(problem.state_for(hypothesis.effect), joint, member.shape)[0],
        pattern=pattern,
    )


def _within_logs(recording: Recording, parameters: Sequence[Parameter], effect: Effect) -> tuple[Parameter, ...]:
    """Limits the intervals of moments to the time of the logs: nothing is known of others."""
    moments = {shape.name for shape in effect.shapes if shape.moment}
    first, last = float(recording.t[0]), float(recording.t[-1])
    return tuple(
        replace(own, ci95=(max(own.ci95[0], first), min(own.ci95[1], last)))
        if own.name in moments and np.isfinite(own.ci95).all()
        else own
        for own in parameters
    )


def _between_logs(recording: Recording, sentence: str, parameters: Sequence[Parameter]) -> tuple[str, bool]:
    """States a change in the pause between two logs by the names of these logs, and whether it is one."""
    for own in parameters:
        for k, start in enumerate(recording.starts[1:]):
            # The first row of a log is as late as a change in the pause before it can be.
            if own.name == "change_time" and recording.t[start - 1] < own.value <= recording.t[start]:
                names = f"between {recording.names[k]} and {recording.names[k + 1]}"
                return re.sub(rf"(at|from) t = {own.value:.2f} s( on)?", names, sentence), True
    return sentence, False


def _uncertain_times(parameters: Sequence[Parameter]) -> str:
    """States what the logs leave open of the time of a change or of a push; begins with a space, or is empty."""
    text = ""
    for own in parameters:
        if own.name == "change_time" and not own.determined and np.isfinite(own.ci95).all():
            text += f" The time of the change is uncertain: between t = {own.ci95[0]:.1f} and {own.ci95[1]:.1f} s."
    times = [own for own in parameters if own.name in ("start", "duration")]
    if len(times) == 2 and not all(np.isfinite(own.ci95).all() for own in times):
        text += " It may have begun earlier or ended later."
    return text


def no_part(finding: Finding) -> Finding:
    """Changes a finding that held-out data rejected into an unexplained residual outside the extended model.

    Args:
        finding: the rejected finding.

    Returns:
        The changed finding.
    """
    if finding.pattern:
        return replace(finding, sentence=f"{finding.sentence} {_NOT_IN_MODEL}")
    sentence = _REJECTED.format(EFFECTS[finding.effect].title)
    return replace(finding, effect="unexplained", parameters=(), rivals=(), sentence=sentence)


_NOT_IN_MODEL = "This correction did not improve the held-out prediction, so the model does not contain it."
_REJECTED = (
    "A significant residual resembles {}, but the held-out data contradict this cause. The true cause is unknown, and "
    "the model does not contain it."
)


def _parameters(
    robot: Robot, member: FittedEffect, fitted: ExtendedFit, i: int, known: NDArray[np.bool_]
) -> tuple[Parameter, ...]:
    """Lists the coefficients and shape parameters of an effect with their 95 % intervals."""
    extension = fitted.model.extensions[i]
    effect = member.hypothesis.effect
    described: list[Coefficient | Shape] = [
        *effect.described(robot, extension.joint, extension.shape),
        *effect.shapes,
    ]
    values = [*extension.coefficients.tolist(), *extension.shape]
    errors = np.sqrt(np.maximum(np.diag(extension.covariance), 0.0))
    largest = NOTHING * float(np.abs(extension.coefficients).max(initial=0.0))
    result = []
    unused = {len(extension.coefficients) + k for k in effect.unused(extension.shape)}
    for k, (own, value, error, sure) in enumerate(zip(described, values, errors, known, strict=True)):
        if not own.name or k in unused or (isinstance(own, Shape) and own.is_left(value)):
            continue
        if isinstance(own, Coefficient) and abs(value) <= largest and not np.isfinite(error):
            # A column that is zero in these logs, such as a knot of a short drift.
            continue
        interval = (value - NORMAL_95 * error, value + NORMAL_95 * error)
        if isinstance(own, Shape) and own.scale == "log" and np.isfinite(error) and value > 0:
            factor = float(np.exp(NORMAL_95 * error / value))
            interval = (value / factor, value * factor)
        rough = isinstance(own, Shape) and (_roughly(own, value, interval) or _stopped(own, value))
        # Values outside these bounds are physically impossible.
        interval = (min(max(interval[0], own.lower), value), max(min(interval[1], own.upper), value))
        result.append(
            Parameter(
                name=own.name,
                value=float(value),
                unit=own.unit_at(robot, extension.joint) if isinstance(own, Shape) else own.unit,
                standard_error=float(error) if np.isfinite(error) else float("nan"),
                ci95=(float(interval[0]), float(interval[1])) if np.isfinite(error) else (-np.inf, np.inf),
                determined=bool(sure) and not rough,
            )
        )
    idle = _perhaps_unused(effect, extension.shape, {parameter.name: parameter.ci95 for parameter in result})
    return tuple(_opened(one) if one.name in idle else one for one in result)


def _stopped(shape: Shape, value: float) -> bool:
    """Whether a shape parameter is at its bound, so that the data may favour a value beyond it."""
    return shape.scale == "log" and value != shape.default and bool(np.isclose(value, [shape.lower, shape.upper]).any())


def _opened(parameter: Parameter) -> Parameter:
    """Marks a parameter as undetermined."""
    return replace(parameter, standard_error=float("nan"), ci95=(-np.inf, np.inf), determined=False)


def _perhaps_unused(effect: Effect, shape: tuple[float, ...], intervals: Mapping[str, tuple[float, float]]) -> set[str]:
    """Names shape parameters without influence if another may be at its default, such as the angle of a zero lever."""
    names: set[str] = set()
    for k, own in enumerate(effect.shapes):
        if own.default is None or own.name not in intervals:
            continue
        low, high = intervals[own.name]
        if low <= own.default <= high:
            idle = effect.unused((*shape[:k], own.default, *shape[k + 1 :]))
            names |= {effect.shapes[i].name for i in idle if i != k}
    return names


def _roughly(shape: Shape, value: float, interval: tuple[float, float]) -> bool:
    """Whether an interval is too wide for a determined value. A position, which may have either sign, never is."""
    half = 0.5 * (interval[1] - interval[0])
    if not np.isfinite(half):
        return False
    if shape.moment:
        return bool(half > MAX_TIME_ERROR)
    return bool(shape.lower >= 0 and half > MAX_RELATIVE_ERROR * abs(value))
