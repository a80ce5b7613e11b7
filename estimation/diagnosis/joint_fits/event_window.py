"""Whether an effect of a moment goes on beside what its formula has of it, and what it is then."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimation.diagnosis.calibration import MIN_BIC_GAIN, MIN_WINDOW_GAIN
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import FittedEffect, refine
from estimation.diagnosis.hypothesis_tests.scoring import Accepted, accept
from estimation.diagnosis.hypothesis_tests.time_windows import best_window
from robots.common.parallel import threaded


def open_event_edges(
    problem: Problem, member: FittedEffect, others: Sequence[FittedEffect], errors: Sequence[float]
) -> list[float]:
    """Makes errors of shape parameters infinite where the data say that the effect goes on beyond them.

    A push on an elbow while the arm moves is no pulse of constant torques: such a pulse is estimated where it is
    largest, and its edges, however sharp they are, are not the push's.

    Args:
        problem: the data.
        member: whose shapes have the errors.
        others: what else was found.
        errors: by the profiles.
    """
    open_ = _open(problem, member, accept(problem, tuple(m.group for m in others)))
    return [np.inf if k in open_ else error for k, error in enumerate(errors)]


def refit_event_window(problem: Problem, member: FittedEffect, beside: Accepted) -> FittedEffect:
    """Gives an effect of a moment by the formula that stays true while it lasts, where that is worth its parameters."""
    hypothesis = member.hypothesis
    if not hypothesis.effect.transient:
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
    """Which shape parameters of a member, beside what is accepted, the data say are not where the effect ends."""
    further = member.hypothesis.effect.open_edges(member.shape)
    if not further:
        return set()
    rest = accept(problem, (member.group, *beside.groups))
    more = ((k, refine(problem, member.hypothesis, shape, rest, effort=0)) for k, shape in further)
    return {k for k, form in more if form.local_bic_gain > MIN_BIC_GAIN}
