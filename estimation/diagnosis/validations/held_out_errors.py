"""Held-out errors and gains of effects, from separate logs or by cross-validation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from estimation.diagnosis.base_models.payload_and_gravity import base_regressor, subtract_known_payload
from estimation.diagnosis.calibration import MIN_JOINT_GAIN, ONE_LOG_ENERGY
from estimation.diagnosis.findings import Gain
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.joint_fits.shrinkage import effects_prior
from estimation.diagnosis.joint_fits.total_torque import effect_columns
from estimation.diagnosis.recordings.log_reading import build_recording
from estimation.diagnosis.recordings.recording import Recording, join_recordings
from estimation.diagnosis.validations.gain_intervals import (
    PARTS,
    HeldOutErrors,
    cross_validation_errors,
    held_out_errors,
)
from estimation.regressions.parameter_priors import GaussianPrior
from robots.common.arrays import Array
from robots.robot import Robot
from robots.signals import Log
from robots.terms.effects import Situation


@dataclass(frozen=True, eq=False)
class HeldOutResult:
    """Errors and gains on held-out data.

    Attributes:
        errors: errors of the base model, the extended model, and the extended model without each member.
        gains: held-out gain of each member.
        rmse_ratio: error with each member over error without it, on all joints on which it acts.
        contradicts: whether held-out rows contradict each member.
        cv_retained_gain: share of the error reduction of each member in the fit that remains on held-out data.
        support: increase of each member's chi2 by the held-out rows, over its gain in the fit.
        coordinates: per member the values (M,) of its plot axis on the held-out data.
        whole: held-out data, preceded by the logs of the fit if those were recorded before.
        first_held_out_row: row of `whole` at which the held-out data begin.
        effects: columns (N, n, k) of each member on the data of the fit.
        torque: torque of all members together on the held-out data (M, n) [N m or N].
        prior: prior of base model, nuisance and members in all fits.
        absent: indices of members that are assumed to be absent from the held-out data.
    """

    errors: HeldOutErrors
    gains: tuple[Gain, ...]
    rmse_ratio: tuple[float, ...]
    contradicts: tuple[bool, ...]
    cv_retained_gain: tuple[float, ...]
    support: tuple[float, ...]
    coordinates: tuple[Array, ...]
    whole: Recording
    first_held_out_row: int
    effects: tuple[Array, ...]
    torque: Array
    prior: GaussianPrior
    absent: frozenset[int] = frozenset()


def measure_held_out(
    problem: Problem,
    members: Sequence[FittedEffect],
    held_out: Recording | None,
    seed: int,
    gone: frozenset[int] = frozenset(),
) -> HeldOutResult:
    """Measures errors and gains on held-out logs, or by cross-validation.

    Args:
        problem: data of the fit.
        members: effects in the model.
        held_out: `read_held_out` of logs not used in the fit; None for cross-validation.
        seed: seed of the bootstrap intervals.
        gone: indices of members that are absent from the held-out logs.

    Returns:
        Errors, gains and support of each member.
    """
    effects = tuple(problem.dense(member.hypothesis, member.shape) for member in members)
    rng = np.random.default_rng(seed)
    pull = effects_prior(problem, members)
    if held_out is not None:
        unseen, states, whole, first, columns = _on_logs(problem, members, effects, held_out, pull, gone)
    else:
        unseen = _left_out(problem, effects, pull)
        states = [problem.state_for(member.hypothesis.effect) for member in members]
        whole, first, columns = problem.recording, 0, list(effects)
    there = slice(first, None)
    torque = np.zeros_like(whole.tau[there])
    for X, member in zip(columns, members, strict=True):
        torque += X @ member.coefficients
    return HeldOutResult(
        errors=unseen,
        gains=tuple(_gain(unseen, i, member, rng) for i, member in enumerate(members)),
        rmse_ratio=tuple(_rise(unseen, i, member) for i, member in enumerate(members)),
        contradicts=tuple(unseen.surely_worse(i + 1) for i in range(len(members))),
        cv_retained_gain=tuple(unseen.retained_share(i + 1, _joints(member)) for i, member in enumerate(members)),
        support=tuple(unseen.growth[i + 1] / max(member.gain, 1e-300) for i, member in enumerate(members)),
        coordinates=tuple(
            m.hypothesis.effect.coordinate(state, m.hypothesis.joint, m.shape)[1][there]
            for m, state in zip(members, states, strict=True)
        ),
        whole=whole,
        first_held_out_row=first,
        effects=effects,
        torque=torque,
        prior=pull,
        absent=gone,
    )


def _left_out(problem: Problem, effects: Sequence[Array], pull: GaussianPrior) -> HeldOutErrors:
    """Cross-validates over logs, or over parts of logs if an effect acts in one log only."""
    recording = problem.recording
    why = found_in_one_log_only(recording, effects)
    if len(recording.runs) == 1 or not why:
        return cross_validation_errors(problem, effects, pull)
    apart = replace(recording, starts=tuple(part.start for part in split_runs(recording)))
    unseen = cross_validation_errors(replace(problem, recording=apart), effects, pull)
    return replace(unseen, how=_WITHIN.format(PARTS, len(recording.runs), why))


_WITHIN = (
    "each of {} stretches of each of {} logs, predicted from all other stretches ({}, so whole logs are not left out)"
)


def found_in_one_log_only(recording: Recording, effects: Sequence[Array]) -> str:
    """States why whole logs cannot be left out: an effect acts, or a joint moves, in one log only.

    Args:
        recording: logs of the fit.
        effects: columns (N, n, k) of each effect.

    Returns:
        The reason as text; empty if there is none.
    """
    for X in effects:
        energies = np.array([float(np.sum(X[run] ** 2)) for run in recording.runs])
        if energies.max() > ONE_LOG_ENERGY * energies.sum():
            return "one finding acts in one log only"
    moves = np.array([~recording.sign_unknown[run].all(axis=0) for run in recording.runs])
    return "a joint moves in one log only" if (moves.sum(axis=0) == 1).any() else ""


def split_runs(recording: Recording) -> list[slice]:
    """Cuts every log into stretches of about equal length.

    Args:
        recording: logs of the fit.

    Returns:
        The rows of each stretch.
    """
    parts = []
    for run in recording.runs:
        edges = np.linspace(run.start, run.stop, PARTS + 1).astype(int)
        parts += [slice(int(a), int(b)) for a, b in pairwise(edges) if b > a]
    return parts


def _gain(unseen: HeldOutErrors, i: int, member: FittedEffect, rng: np.random.Generator) -> Gain:
    """Computes the held-out gain of one member, averaged over the joints on which it acts."""
    joints = _joints(member)
    last = len(unseen.errors) - 1
    low, high = unseen.interval(i + 1, last, joints, rng)
    return Gain(
        nrmse_before=float(unseen.nrmse(i + 1)[joints].mean()),
        nrmse_after=float(unseen.nrmse(last)[joints].mean()),
        ci95=(low, high),
        joints=tuple(j + 1 for j in joints),
    )


def _joints(member: FittedEffect) -> list[int]:
    """Lists the joints, counted from 0, over which a member's gain is averaged.

    An error of one joint may act mainly on others. An encoder offset, for example, acts on the joints that carry
    gravity.
    """
    if member.hypothesis.joint is None:
        return list(member.group.joints)
    gains = {j: member.gain_on([j]) for j in member.group.joints}
    shown = [j for j, gain in gains.items() if gain > MIN_JOINT_GAIN * sum(gains.values())]
    return shown or [member.hypothesis.joint - 1]


def _rise(unseen: HeldOutErrors, i: int, member: FittedEffect) -> float:
    """Returns the error with a member over the error without it, on all joints on which it acts."""
    joints = list(member.group.joints)
    before, after = (float(np.sum(unseen.nrmse(model)[joints] ** 2)) for model in (i + 1, len(unseen.errors) - 1))
    return float(np.sqrt(after / max(before, 1e-300)))


def read_held_out(robot: Robot, problem: Problem, logs: Sequence[Log]) -> Recording | None:
    """Reads held-out logs onto the grid of the fit; None for none."""
    if not logs:
        return None
    recording = problem.recording
    travel = np.max([np.ptp(recording.q[run], axis=0) for run in recording.runs], axis=0)
    unseen = build_recording(robot, logs, step=recording.step, travel=travel)
    return subtract_known_payload(robot, unseen).with_trusted(recording.trusted)


def _on_logs(
    problem: Problem,
    members: Sequence[FittedEffect],
    effects: Sequence[Array],
    other: Recording,
    pull: GaussianPrior,
    gone: frozenset[int],
) -> tuple[HeldOutErrors, list[Situation], Recording, int, list[Array]]:
    """Computes the errors on held-out logs, and the states and columns of the members there."""
    recording = problem.recording
    # One clock: later held-out logs start with the heat of the logs before.
    later = bool(other.t[0] > recording.t[-1])
    whole = join_recordings([recording, other]) if later else other
    first = len(recording) if later else 0
    states, columns = effect_columns(problem, whole, members)
    columns = [X[first:] * (i not in gone) for i, X in enumerate(columns)]
    baseline = problem.baseline
    base = np.zeros((len(other), *baseline.columns.shape[1:]))
    base[:, :, : baseline.base.size] = base_regressor(baseline.base, other)
    unseen = held_out_errors(problem, effects, other, base, columns, pull)
    return unseen, states, whole, first, columns
