"""Joint refit of base model and selected effects, and whether it requires another search."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import refine_member
from estimation.diagnosis.joint_fits.gear_load import NO_GEAR_LOAD, GearLoadFit, find_gear_load
from estimation.diagnosis.joint_fits.sensor_nonlinearity import fit_sensor_nonlinearity
from estimation.diagnosis.joint_fits.total_torque import fit_clipped_torque, fit_jointly, total_torque_from_unclipped
from estimation.diagnosis.noise_models.noise_nuisance_basis import is_short
from estimation.diagnosis.noise_models.whitening import Whitening
from estimation.diagnosis.recordings.recording import Recording
from estimation.diagnosis.recordings.thinning import shift_motion
from robots.common.arrays import Array
from robots.terms.effect_bases.capabilities import AtReversals
from robots.terms.effect_bases.gear_load import with_gear_load

# Change of the log of the noise from which the search is repeated.
MIN_NOISE_CHANGE = 0.03
# The same of the noise's slowest part.
MIN_SLOW_NOISE_CHANGE = 0.1
# Change of the base model's torque from which it is repeated.
MIN_BASE_CHANGE = 0.02
# Change of an effect's torque from which it is repeated.
MIN_EFFECT_CHANGE = 0.2
# Clipped torque, as a share of the largest, above which a row is not used as a measurement.
CUT = 0.01


@dataclass(frozen=True, eq=False)
class RefitResult:
    """Base model and effects, fitted together.

    Attributes:
        residual: residual (N, n) [N m or N] from which noise is estimated; without prior unless the logs are short.
        values: base parameters (b,).
        extra: torque of the effects (N, n) [N m or N]; None without any.
        degrees: number of parameters of the effects.
        delayed: torque (N, n) of the effects that do not smooth the friction sign; None if no effect smooths it.
        delay_torque: torque (N, n) of delays of the whole robot; None without any.
        gear_load: load of the effects on the gears.
    """

    residual: Array
    values: Array
    extra: Array | None = None
    degrees: int = 0
    delayed: Array | None = None
    delay_torque: Array | None = None
    gear_load: GearLoadFit = NO_GEAR_LOAD

    def without_delay(self) -> tuple[Array, Array | None]:
        """Returns residual and torque of the effects without delays of the whole robot.

        Returns:
            Residual (N, n) and torque (N, n) [N m or N]; None for the torque without effects.
        """
        if self.extra is None or self.delay_torque is None:
            return self.residual, self.extra
        return self.residual + self.delay_torque, self.extra - self.delay_torque

    def delayed_motion(self, recording: Recording, members: Sequence[FittedEffect]) -> Recording:
        """Returns the recording from which the width of the friction sign is estimated.

        The torque is without effects that smooth the friction sign, and the motion is delayed like the torque.

        Args:
            recording: logs of the fit.
            members: effects of the fit.
        """
        late = [m for m in members if m.hypothesis.effect.delays_all_torque]
        beyond = self.without_delay()[1]
        blurring = 0.0 if beyond is None or self.delayed is None else beyond - self.delayed
        return shift_motion(replace(recording, tau=recording.tau - blurring), sum(m.shape[0] for m in late))


def refit(problem: Problem, members: Sequence[FittedEffect]) -> RefitResult:
    """Fits base model and effects together.

    Clipped torque biases the base model towards the clipped value, and the estimated clipping then follows that model.
    The base model is therefore first fitted without clipped rows, then together with the clipping. Distortions of the
    torque measurement are fitted jointly.

    Args:
        problem: whitened data.
        members: selected effects.

    Returns:
        The joint fit.
    """
    useless = [_unusable_rows(problem, member) for member in members]
    cut = [k for k, flags in enumerate(useless) if flags is not None]
    if cut:
        flags = np.logical_or.reduce([flags for flags in useless if flags is not None])
        problem = fit_clipped_torque(total_torque_from_unclipped(problem, members, flags), members)
        members = [refine_member(problem, members, k) if k in cut else member for k, member in enumerate(members)]
    problem, members = fit_sensor_nonlinearity(problem, members)
    values, left, full = fit_jointly(problem, members)
    known = len(problem.prior.target)
    effects = [(m.hypothesis.effect, len(m.coefficients)) for m in members]
    plain = np.concatenate([np.repeat(effect.at_reversals is not AtReversals.LATE, size) for effect, size in effects])
    late = np.concatenate([np.repeat(effect.delays_all_torque, size) for effect, size in effects])
    return RefitResult(
        residual=left,
        values=values[: problem.baseline.base.size],
        extra=full[:, :, known:] @ values[known:],
        degrees=sum(member.degrees for member in members),
        delayed=None if plain.all() else full[:, :, known:] @ (values[known:] * plain),
        delay_torque=full[:, :, known:] @ (values[known:] * late) if late.any() else None,
        gear_load=find_gear_load(problem, members, values),
    )


def noise_decreased(problem: Problem, whitening: Whitening) -> bool:
    """Whether the noise, or its slow part, is clearly smaller than assumed in the search.

    The slow part counts only if the logs are not short.

    Args:
        problem: data with the noise model of the search.
        whitening: noise model from the residual of the joint fit.
    """
    before = problem.whitening
    if np.max(np.log(before.scale / whitening.scale)) > MIN_NOISE_CHANGE:
        return True
    slower = np.log(before.at_rest / whitening.at_rest)
    return bool(np.max(slower) > MIN_SLOW_NOISE_CHANGE) and not is_short(problem.recording)


def base_torque_changed(problem: Problem, values: Array, members: Sequence[FittedEffect]) -> bool:
    """Whether the base model's torque, or that of an effect on it, changed enough for another search.

    Effects of load or friction were measured with a base model that had absorbed part of other effects. A clipping
    torque is a small difference of large torques, so a small change of the base model changes it much.

    Args:
        problem: data with the base model of the search.
        values: base parameters (b,) of the joint fit.
        members: selected effects.
    """
    base = problem.baseline.base
    full = np.zeros(base.model.size)
    full[list(base.independent)] = values
    change = problem.baseline.regressor @ (full - problem.parameters_without_payload)[list(base.independent)]
    torque = np.sqrt(np.mean(problem.recording.tau**2, axis=0))
    if np.max(np.sqrt(np.mean(change**2, axis=0)) / np.maximum(torque, 1e-12)) > MIN_BASE_CHANGE:
        return True
    state = problem.baseline.situation(problem.recording, values[: base.size])
    now = replace(problem, situation=with_gear_load(state, problem.extra_load))
    for member in members:
        before, after = (member.torque(p) for p in (problem, now))
        if np.sum((after - before) ** 2) > MIN_EFFECT_CHANGE**2 * np.sum(before**2):
            return True
    return False


def _unusable_rows(problem: Problem, member: FittedEffect) -> NDArray[np.bool_] | None:
    """Flags the rows (N, n) that an effect makes useless as torque measurements; None for no such effect."""
    hypothesis = member.hypothesis
    flags = hypothesis.effect.gate(problem.situation, hypothesis.joint, problem.recording.tau)
    if flags is None:
        return None
    lost = np.abs(problem.dense(hypothesis, member.shape)).max(axis=2)
    return np.asarray(flags | (lost > CUT * lost.max()))
