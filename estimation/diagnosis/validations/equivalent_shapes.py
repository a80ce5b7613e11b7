"""Shapes of one effect that fit about equally well, ranked by their evidence under the base model's prior.

Within the angles of a log, a polynomial and a balancer with a lever can have the same spring torque. Beyond those
angles they differ, and so do the gravity parameters that the base model takes beside them. The prior from the robot's
description ranks them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from estimation.diagnosis.calibration import MAX_SHAPE_CHI2, MIN_BIC_GAIN
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect, accept_all_but
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import refine
from estimation.diagnosis.hypothesis_tests.scoring import accept
from estimation.diagnosis.joint_fits.shrinkage import effects_prior
from estimation.diagnosis.searches.selection import SelectedEffect
from estimation.regressions.moments import Moments


def equivalent_shapes(problem: Problem, members: Sequence[FittedEffect], i: int) -> list[FittedEffect]:
    """Lists other shapes of a member that fit about as well beside the other members, the most likely first.

    Args:
        problem: whitened data.
        members: effects in the model.
        i: index of the member.

    Returns:
        The member with each of the other shapes, refitted.
    """
    own, others = members[i], [m for k, m in enumerate(members) if k != i]
    shapes = own.hypothesis.effect.forms(problem.situation, own.hypothesis.joint)
    beside = accept(problem, tuple(m.group for m in others))
    forms = [refine(problem, own.hypothesis, shape, beside, effort=0) for shape in shapes if shape != own.shape]
    forms = [form for form in forms if form.gain > own.gain - MAX_SHAPE_CHI2]
    return sorted(forms, key=_evidence(problem, others), reverse=True) if forms else []


def complete_effects(problem: Problem, founds: Sequence[SelectedEffect]) -> tuple[SelectedEffect, ...]:
    """Adds the optional shape parameters of each effect where the BIC gain remains sufficient.

    The search leaves out coefficients that are poorly determined. Without them the others are biased, and their
    standard errors are too small.

    Args:
        problem: whitened data.
        founds: selected effects.

    Returns:
        The same effects, some with more shape parameters.
    """
    members = [found.effect for found in founds]
    whole = []
    for i, found in enumerate(founds):
        own = found.effect
        shape = own.hypothesis.effect.complete(problem.situation, own.hypothesis.joint, own.shape)
        if shape != own.shape:
            form = refine(problem, own.hypothesis, shape, accept_all_but(problem, members, i))
            found = replace(found, effect=form) if form.local_bic_gain > MIN_BIC_GAIN else found
        whole.append(found)
    return tuple(whole)


def _evidence(problem: Problem, others: Sequence[FittedEffect]) -> Callable[[FittedEffect], float]:
    """Returns the function that computes twice the log evidence of a shape, up to a constant for all shapes."""
    baseline, white = problem.baseline, problem.whitening
    blocks = [baseline.columns, *(problem.dense(m.hypothesis, m.shape) for m in others)]
    known, tau = white.independent(np.concatenate(blocks, axis=2)), white.independent(problem.recording.tau)

    def evidence(form: FittedEffect) -> float:
        flat = np.hstack([known, white.independent(problem.dense(form.hypothesis, form.shape))])
        pull = effects_prior(problem, [*others, form]).times(1.0 / white.row_weight)
        moments = Moments.of(flat[:, None], tau[:, None]).pulled(pull)
        both = moments.gram[0] + pull.precision
        scale = np.sqrt(np.maximum(np.diag(both), 1e-300))
        volume = np.linalg.slogdet(both / scale[:, None] / scale)[1] + 2.0 * float(np.sum(np.log(scale)))
        prior = float(np.sum(np.log(np.maximum(np.diag(pull.precision)[known.shape[1] :], 1e-300))))
        return moments.explained() - float(volume) + prior

    return evidence
