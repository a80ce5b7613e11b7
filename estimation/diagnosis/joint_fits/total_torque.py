"""Estimate of the total torque, on which effects such as a current limit act."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from estimation.diagnosis.base_models.payload_and_gravity import build_situation
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.joint_fits.extended_fit import reversal_columns
from estimation.diagnosis.noise_models.noise_nuisance_basis import is_short
from estimation.diagnosis.recordings.recording import Recording
from estimation.regressions.moments import Moments
from robots.common.arrays import Array, Flags
from robots.terms.effect_bases.capabilities import AtReversals, Reading
from robots.terms.effect_bases.gear_load import with_gear_load
from robots.terms.effects import Situation

ROUNDS = 4
"""Gauss-Newton iterations of the total torque."""
STEP = 1e-3
"""Torque step of the numerical derivative of clipping, as a share of the torque RMS."""


def with_total_torque(problem: Problem, members: Sequence[FittedEffect], hypotheses: Sequence[Hypothesis]) -> Problem:
    """Adds the total torque to the inputs of effects that act on it, if a log shows unusable samples.

    The total torque is that of base model and other effects, fitted together. Effects that delay all torque get the
    torque of the other effects as fitted. Without unusable samples nothing is estimated: clipping is then a small part
    of the torque.

    Args:
        problem: data and base model.
        members: effects that are already in the model.
        hypotheses: hypotheses to be tested, some of which may act on the total torque.
    """
    others = [member for member in members if member.hypothesis.effect.at_reversals is not AtReversals.LATE]
    if others and any(hypothesis.effect.at_reversals is AtReversals.LATE for hypothesis in hypotheses):
        beyond = np.sum([m.torque(problem) for m in others], axis=0)
        problem = replace(problem, delayed_torque_state=problem.situation.beside(beyond))
    useless = np.zeros_like(problem.recording.sign_unknown)
    for hypothesis in hypotheses:
        if hypothesis.effect.reading is Reading.CUTS:
            flags = hypothesis.effect.gate(problem.situation, hypothesis.joint, problem.recording.tau)
            useless |= False if flags is None else flags
    return (
        fit_clipped_torque(total_torque_from_unclipped(problem, members, useless), members)
        if useless.any()
        else problem
    )


def total_torque_from_unclipped(problem: Problem, members: Sequence[FittedEffect], useless: Flags) -> Problem:
    """Estimates the total torque from usable rows only.

    Args:
        problem: data and base model.
        members: effects in the model; those that act on the total torque are left out.
        useless: rows without a usable torque measurement (N, n).
    """
    before = [member for member in members if member.hypothesis.effect.reading is not Reading.CUTS]
    known = JointFit(problem, before, ~useless)
    return known.total_torque(known.values(problem.recording.tau))


def fit_clipped_torque(problem: Problem, members: Sequence[FittedEffect]) -> Problem:
    """Estimates the total torque from all rows, if one of the effects acts on it.

    Unclipped rows alone give a torque that is too small, because noise decides which rows are clipped. The mean clipped
    torque is therefore fitted to all rows (Gauss-Newton). Each row's columns are scaled by the derivative of clipping.

    Args:
        problem: data and base model, with a first estimate of the total torque.
        members: all effects in the model.
    """
    last = [member for member in members if member.hypothesis.effect.reading is Reading.CUTS]
    if not last or problem.total_torque_state is None:
        return problem
    before = [member for member in members if member.hypothesis.effect.reading is not Reading.CUTS]
    known = JointFit(problem, before, np.ones_like(problem.recording.sign_unknown))
    step = STEP * np.sqrt(np.mean(problem.recording.tau**2, axis=0))
    values = known.values(problem.recording.tau - _lost(problem, last))
    for _ in range(ROUNDS):
        problem = known.total_torque(values)
        lost, more, less = (_lost(_with_more(problem, by), last) for by in (0.0 * step, step, -step))
        passes = np.clip(1.0 + (more - less) / (2.0 * step), 0.0, 1.0)
        torque = known.full @ values
        values = known.values(problem.recording.tau - torque - lost + passes * torque, passes)
    return known.total_torque(values)


def _lost(problem: Problem, members: Sequence[FittedEffect]) -> Array:
    """Returns the torque (N, n) removed by effects that act on the total torque."""
    return np.sum([problem.dense(member.hypothesis, member.shape).sum(axis=2) for member in members], axis=0)


def _with_more(problem: Problem, torque: Array) -> Problem:
    whole = problem.total_torque_state
    assert whole is not None
    return replace(
        problem, total_torque_state=whole.beside(torque + (whole.beyond if whole.beyond is not None else 0.0))
    )


class JointFit:
    """Joint fit of base model, nuisance and effects to the rows that count.

    Args:
        problem: data and base model.
        members: the effects.
        counted: rows (N, n) to be used, in addition to a known friction sign.
    """

    def __init__(self, problem: Problem, members: Sequence[FittedEffect], counted: Flags) -> None:
        baseline, recording = problem.baseline, problem.recording
        blocks = [problem.dense(member.hypothesis, member.shape) for member in members]
        self.problem = problem
        self.full = np.concatenate([baseline.columns, *blocks], axis=2)
        edges = np.cumsum([baseline.columns.shape[2], *(b.shape[2] for b in blocks)])
        self.timed = reversal_columns(members, edges[:-1].tolist(), (recording.n, self.full.shape[2]))
        self.weights = (counted & ~recording.sign_unknown) / problem.whitening.scales(len(recording))

    def values(self, tau: Array, passes: Array | None = None) -> Array:
        """Fits all values (b,) to torque by their posterior maximum.

        Args:
            tau: torque (N, n) [N m or N].
            passes: derivative of the reading by the torque (N, n); 1 by default.
        """
        return self.moments(tau, self.full if passes is None else self.full * passes[:, :, None]).posterior()

    def moments(self, tau: Array, columns: Array) -> Moments:
        """Returns the normal equations of torque (N, n) for given columns, with the prior.

        Args:
            tau: torque (N, n) [N m or N].
            columns: (N, n, p), the first b of which correspond to `full`.
        """
        moments = Moments.of(columns, tau, self.weights).joined().pulled(self.problem.prior)
        if self.problem.timing is None:
            return moments
        more = np.zeros((len(self.timed), 1, columns.shape[2]))
        more[:, 0, : self.full.shape[2]] = self.timed
        return moments + Moments.of(more, self.problem.timing.residual[:, None])

    def total_torque(self, values: Array) -> Problem:
        """Returns the problem with the total torque of these values (b,)."""
        problem, known = self.problem, len(self.problem.prior.target)
        now = problem.baseline.situation(problem.recording, values[: problem.baseline.base.size])
        beyond = self.full[:, :, known:] @ values[known:] if len(values) > known else None
        return replace(problem, total_torque_state=now.beside(beyond))


def fit_jointly(problem: Problem, members: Sequence[FittedEffect]) -> tuple[Array, Array, Array]:
    """Fits base model, nuisance and effects together.

    Returns:
        All values (b,); the residual (N, n) from which the noise is estimated; all columns (N, n, b).
    """
    both, tau = JointFit(problem, members, np.ones_like(problem.recording.sign_unknown)), problem.recording.tau
    moments = both.moments(tau, both.full)
    values = moments.posterior()
    free = values if is_short(problem.recording) else moments.pulled(None).posterior()
    return values, tau - both.full @ free, both.full


def effect_columns(
    problem: Problem, recording: Recording, members: Sequence[FittedEffect]
) -> tuple[list[Situation], list[Array]]:
    """Evaluates the inputs of effects in another recording, and their columns there.

    Args:
        problem: data and base model of the fit.
        recording: the other recording (N rows).
        members: effects of the fit.

    Returns:
        One situation and one array of columns (N, n, k) per effect.
    """
    model = problem.situation.model
    own = build_situation(recording, model, problem.parameters_without_payload)
    now = with_gear_load(replace(own, since=problem.situation.origin), problem.extra_load)
    states, columns = [now] * len(members), [m.hypothesis.dense(now, m.shape) for m in members]
    late = [k for k, member in enumerate(members) if member.hypothesis.effect.at_reversals is AtReversals.LATE]
    if problem.delayed_torque_state is not None and 0 < len(late) < len(members):
        plain = [columns[k] @ member.coefficients for k, member in enumerate(members) if k not in late]
        followed = now.beside(np.sum(plain, axis=0))
        for k in late:
            states[k], columns[k] = followed, members[k].hypothesis.dense(followed, members[k].shape)
    if problem.total_torque_state is not None:
        whole = build_situation(
            recording, model, replace(problem, situation=problem.total_torque_state).parameters_without_payload
        )
        parts = [
            X @ m.coefficients
            for X, m in zip(columns, members, strict=True)
            if m.hypothesis.effect.reading is not Reading.CUTS
        ]
        whole = whole.beside(np.sum(parts, axis=0) if parts else None)
        for k, member in enumerate(members):
            if member.hypothesis.effect.reading is Reading.CUTS:
                states[k], columns[k] = whole, member.hypothesis.dense(whole, member.shape)
    return states, columns
