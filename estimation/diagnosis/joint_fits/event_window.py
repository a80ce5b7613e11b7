"""Window of a transient effect: whether it continues beyond the fitted one, and a formula that holds throughout."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimation.diagnosis.calibration import MIN_BIC_GAIN
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import refine
from estimation.diagnosis.hypothesis_tests.scoring import Accepted, accept
from estimation.diagnosis.hypothesis_tests.time_windows import best_window
from robots.common.parallel import threaded
from robots.terms.effect_bases.capabilities import Persistence

# Share of its chi-square that a finer search of an event's window may add.
MIN_WINDOW_GAIN = 0.1


def open_event_edges(
    problem: Problem, member: FittedEffect, others: Sequence[FittedEffect], errors: Sequence[float]
) -> list[float]:
    """Sets the errors of window edges to infinity where the data show that the effect continues.

    A contact with a moving arm is not a pulse of constant joint torques. Such a pulse fits where the contact is
    largest, so its sharp edges are not those of the contact.

    Args:
        problem: data and base model.
        member: the effect.
        others: other effects found.
        errors: standard errors of its shape parameters.

    Returns:
        The errors (s,), infinite for open edges.
    """
    open_ = _open(problem, member, accept(problem, tuple(m.group for m in others)))
    return [np.inf if k in open_ else error for k, error in enumerate(errors)]


def refit_event_window(problem: Problem, member: FittedEffect, beside: Accepted) -> FittedEffect:
    """Refits a transient effect by a formula that holds for its whole duration, if the BIC improves.

    Args:
        problem: data and base model.
        member: the effect; others than transient ones are returned unchanged.
        beside: groups already in the model.
    """
    hypothesis = member.hypothesis
    if hypothesis.effect.persistence is not Persistence.TRANSIENT:
        return member
    shapes = hypothesis.effect.sustained_shapes(problem.state_for(hypothesis.effect), member.shape)
    if not shapes:
        return member
    start, duration = member.shape[:2]
    windows = threaded(lambda shape: best_window(problem, hypothesis, shape, beside, (start, start + duration)), shapes)
    forms = [(own.gain, (own.start, own.duration, *shape[2:])) for own, shape in zip(windows, shapes, strict=True)]
    near = refine(problem, hypothesis, max(forms)[1], beside, effort=0)
    if near.bic_gain + MIN_WINDOW_GAIN * near.gain < member.bic_gain:
        return member
    best = refine(problem, hypothesis, near.shape, beside)
    return best if best.bic_gain > member.bic_gain + MIN_BIC_GAIN else member


def _open(problem: Problem, member: FittedEffect, beside: Accepted) -> set[int]:
    """Returns the indices of shape parameters at which the effect continues."""
    further = member.hypothesis.effect.open_edges(member.shape)
    if not further:
        return set()
    rest = accept(problem, (member.group, *beside.groups))
    more = ((k, refine(problem, member.hypothesis, shape, rest, effort=0)) for k, shape in further)
    return {k for k, form in more if form.local_bic_gain > MIN_BIC_GAIN}
