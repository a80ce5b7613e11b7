"""What acts on all of the torque, such as a limit of current, in sight of base model and other effects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.base_models.payload_and_gravity import build_situation
from estimation.diagnosis.base_models.priors import solve_least_squares, solve_map
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import FittedEffect
from estimation.diagnosis.joint_fits.extended_fit import dense, reversal_columns
from estimation.diagnosis.noise_models.noise_nuisance_basis import is_short
from estimation.diagnosis.recordings.recording import Recording
from robots.terms.effect_bases.gear_load import with_gear_load
from robots.terms.effects import Situation

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

ROUNDS = 4
"""In which all of the torque is found by what is left of it."""
STEP = 1e-3
"""Change of the torque, as a share of its root mean square, by which it is told what passes."""


def with_total_torque(problem: Problem, members: Sequence[FittedEffect], hypotheses: Sequence[Hypothesis]) -> Problem:
    """Lets effects that act on all of the torque know what it is: base model and other members, fitted together.

    What makes all of the torque late knows that of the other members as they are. Where no log shows by itself that
    samples are useless as measurements, no more is estimated: what is clipped elsewhere is a small part.

    Args:
        problem: the data.
        members: what is known to act.
        hypotheses: of which some may act on all of the torque.
    """
    others = [member for member in members if not member.hypothesis.effect.smooths_friction_sign]
    if others and any(hypothesis.effect.smooths_friction_sign for hypothesis in hypotheses):
        beyond = np.sum([dense(problem, m.hypothesis, m.shape) @ m.coefficients for m in others], axis=0)
        problem = replace(problem, delayed_torque_state=problem.situation.beside(beyond))
    useless = np.zeros_like(problem.recording.sign_unknown)
    for hypothesis in hypotheses:
        if hypothesis.effect.acts_on_total_torque:
            flags = hypothesis.effect.gate(problem.situation, hypothesis.joint, problem.recording.tau)
            useless |= False if flags is None else flags
    return (
        fit_clipped_torque(total_torque_from_unclipped(problem, members, useless), members)
        if useless.any()
        else problem
    )


def total_torque_from_unclipped(problem: Problem, members: Sequence[FittedEffect], useless: Flags) -> Problem:
    """Tells all of the torque by the rows (N, n) that are of use, and members that do not act on all of it."""
    before = [member for member in members if not member.hypothesis.effect.acts_on_total_torque]
    known = JointFit(problem, before, ~useless)
    return known.total_torque(known.values(problem.recording.tau))


def fit_clipped_torque(problem: Problem, members: Sequence[FittedEffect]) -> Problem:
    """Tells all of the torque by all rows, where what acts on it is among the members.

    Without the useless rows alone, those that noise has kept from being so would make it too small. So the torque as it
    is cut on average is fitted to all of them (Gauss and Newton): a row counts by what of its torque's changes passes.
    """
    last = [member for member in members if member.hypothesis.effect.acts_on_total_torque]
    if not last or problem.total_torque_state is None:
        return problem
    before = [member for member in members if not member.hypothesis.effect.acts_on_total_torque]
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
    return np.sum([dense(problem, member.hypothesis, member.shape).sum(axis=2) for member in members], axis=0)


def _with_more(problem: Problem, torque: Array) -> Problem:
    whole = problem.total_torque_state
    assert whole is not None
    return replace(
        problem, total_torque_state=whole.beside(torque + (whole.beyond if whole.beyond is not None else 0.0))
    )


class JointFit:
    """Base model, nuisance and members fitted together to the rows (N, n) that count."""

    def __init__(self, problem: Problem, members: Sequence[FittedEffect], counted: Flags) -> None:
        baseline, recording = problem.baseline, problem.recording
        blocks = [dense(problem, member.hypothesis, member.shape) for member in members]
        self.problem = problem
        self.full = np.concatenate([baseline.regressor, baseline.nuisance, *blocks], axis=2)
        edges = np.cumsum([baseline.regressor.shape[2] + baseline.nuisance.shape[2], *(b.shape[2] for b in blocks)])
        self.timed = reversal_columns(members, edges[:-1].tolist(), (recording.n, self.full.shape[2]))
        self.weights = (counted & ~recording.sign_unknown) / problem.whitening.scales(len(recording))

    def values(self, tau: Array, passes: Array | None = None) -> Array:
        """Fits torque (N, n), of whose changes a share passes (N, n)."""
        return solve_map(*self.moments(tau, passes), self.problem.prior)

    def moments(self, tau: Array, passes: Array | None = None) -> tuple[Array, Array]:
        """Gives the normal equations (b, b), (b,) of such a fit."""
        return self.normal(tau, self.full if passes is None else self.full * passes[:, :, None])

    def normal(self, tau: Array, columns: Array) -> tuple[Array, Array]:
        """Gives those of torque (N, n) by columns (N, n, p), the first of which are members' as in `full`."""
        flat = (columns * self.weights[:, :, None]).reshape(-1, columns.shape[2])
        gram, cross, b = flat.T @ flat, flat.T @ (tau * self.weights).reshape(-1), self.full.shape[2]
        gram[:b, :b] += self.timed.T @ self.timed
        if self.problem.timing is not None:
            cross[:b] += self.timed.T @ self.problem.timing.residual
        return gram, cross

    def total_torque(self, values: Array) -> Problem:
        """The problem, all of the torque known by these values."""
        problem, known = self.problem, len(self.problem.prior.target)
        now = problem.baseline.situation(problem.recording, values[: problem.baseline.base.size])
        beyond = self.full[:, :, known:] @ values[known:] if len(values) > known else None
        return replace(problem, total_torque_state=now.beside(beyond))


def fit_jointly(problem: Problem, members: Sequence[FittedEffect]) -> tuple[Array, Array, Array]:
    """Fits base model, nuisance and members together.

    Returns:
        All values (b,); what the fit leaves (N, n) on which noise is measured; all columns (N, n, b).
    """
    both, tau = JointFit(problem, members, np.ones_like(problem.recording.sign_unknown)), problem.recording.tau
    gram, cross = both.moments(tau)
    values = solve_map(gram, cross, problem.prior)
    return (
        values,
        tau - both.full @ (values if is_short(problem.recording) else solve_least_squares(gram, cross)),
        both.full,
    )


def effect_columns(
    problem: Problem, recording: Recording, members: Sequence[FittedEffect]
) -> tuple[list[Situation], list[Array]]:
    """Evaluates what members depend on in another recording, and their columns (N, n, k) there."""
    model = problem.situation.model
    own = build_situation(recording, model, problem.parameters_without_payload)
    now = with_gear_load(replace(own, since=problem.situation.origin), problem.extra_load)
    states, columns = [now] * len(members), [_dense(now, member) for member in members]
    late = [k for k, member in enumerate(members) if member.hypothesis.effect.smooths_friction_sign]
    if problem.delayed_torque_state is not None and 0 < len(late) < len(members):
        plain = [columns[k] @ member.coefficients for k, member in enumerate(members) if k not in late]
        followed = now.beside(np.sum(plain, axis=0))
        for k in late:
            states[k], columns[k] = followed, _dense(followed, members[k])
    if problem.total_torque_state is not None:
        whole = build_situation(
            recording, model, replace(problem, situation=problem.total_torque_state).parameters_without_payload
        )
        parts = [
            X @ m.coefficients
            for X, m in zip(columns, members, strict=True)
            if not m.hypothesis.effect.acts_on_total_torque
        ]
        whole = whole.beside(np.sum(parts, axis=0) if parts else None)
        for k, member in enumerate(members):
            if member.hypothesis.effect.acts_on_total_torque:
                states[k], columns[k] = whole, _dense(whole, member)
    return states, columns


def _dense(state: Situation, member: FittedEffect) -> Array:
    X = np.zeros((*state.q.shape, len(member.coefficients)))
    for j, part in zip(*member.hypothesis.columns(state, member.shape), strict=True):
        X[:, j] = part
    return X
