"""Base model and effects found, brought into line: what one search leaves for the next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.calibration import MIN_BASE_CHANGE, MIN_EFFECT_CHANGE, MIN_NOISE_CHANGE, MIN_SLOW_NOISE_CHANGE
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import FittedEffect, refine
from estimation.diagnosis.hypothesis_tests.scoring import accept
from estimation.diagnosis.joint_fits.extended_fit import dense
from estimation.diagnosis.joint_fits.gear_load import NO_GEAR_LOAD, GearLoad, find_gear_load
from estimation.diagnosis.joint_fits.sensor_nonlinearity import fit_sensor_nonlinearity
from estimation.diagnosis.joint_fits.total_torque import fit_clipped_torque, fit_jointly, total_torque_from_unclipped
from estimation.diagnosis.noise_models.noise_nuisance_basis import is_short
from estimation.diagnosis.noise_models.whitening import Whitening
from estimation.diagnosis.recordings.log_reading import Recording
from estimation.diagnosis.recordings.thinning import shift_motion
from robots.terms.effect_bases.gear_load import with_gear_load

Array = NDArray[np.float64]

# Rows in which more than this share of the most is cut off are useless as measurements.
CUT = 0.01


@dataclass(frozen=True, eq=False)
class RefitResult:
    """Base model and effects, fitted together.

    Attributes:
        residual: what they leave (N, n) [N m or N] where nothing holds the base model: what noise is measured on.
        values: base parameters (b,).
        extra: torque of the effects (N, n) [N m or N]; None without any.
        degrees: parameters of the effects.
        delayed: torque (N, n) of those that others among them make late; None without such others.
        delay_torque: torque (N, n) by which all of it is late; None where it is not.
        gear_load: what of the effects the gears bear.
    """

    residual: Array
    values: Array
    extra: Array | None = None
    degrees: int = 0
    delayed: Array | None = None
    delay_torque: Array | None = None
    gear_load: GearLoad = NO_GEAR_LOAD

    def without_delay(self) -> tuple[Array, Array | None]:
        """What all effects but those leave by which all torque is late, and their torque (N, n); None without any."""
        if self.extra is None or self.delay_torque is None:
            return self.residual, self.extra
        return self.residual + self.delay_torque, self.extra - self.delay_torque

    def delayed_motion(self, recording: Recording, members: Sequence[FittedEffect]) -> Recording:
        """What shows how sharply friction turns round: torque without what blurs that, motion as late as all of it is.

        What other effects have at low speeds may stand for a sign that was taken to be less sharp than it is.
        """
        late = [m for m in members if m.hypothesis.effect.lags and m.hypothesis.effect.whole_robot]
        beyond = self.without_delay()[1]
        blurring = 0.0 if beyond is None or self.delayed is None else beyond - self.delayed
        return shift_motion(replace(recording, tau=recording.tau - blurring), sum(m.shape[0] for m in late))


def refit(problem: Problem, members: Sequence[FittedEffect]) -> RefitResult:
    """Fits base model and effects together.

    Clipped torque biases the base model towards the clipped value, and the estimated clipping then follows that model.
    So the base model is fitted without such rows first, then to the torque as it is cut; and the cut beside it. What
    distorts a reading is fitted beside it at once.
    """
    useless = [_unusable_rows(problem, member) for member in members]
    cut = [k for k, flags in enumerate(useless) if flags is not None]
    if cut:
        flags = np.logical_or.reduce([flags for flags in useless if flags is not None])
        problem = fit_clipped_torque(total_torque_from_unclipped(problem, members, flags), members)
        members = [_again(problem, members, k) if k in cut else member for k, member in enumerate(members)]
    problem, members = fit_sensor_nonlinearity(problem, members)
    values, left, full = fit_jointly(problem, members)
    known = len(problem.prior.target)
    effects = [(m.hypothesis.effect, len(m.coefficients)) for m in members]
    plain = np.concatenate([np.repeat(not effect.smooths_friction_sign, size) for effect, size in effects])
    late = np.concatenate([np.repeat(effect.lags and effect.whole_robot, size) for effect, size in effects])
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
    """Whether the noise without what was found is smaller than it was taken to be, or its slow part as far as known."""
    before = problem.whitening
    if np.max(np.log(before.scale / whitening.scale)) > MIN_NOISE_CHANGE:
        return True
    slower = np.log(before.at_rest / whitening.at_rest)
    return bool(np.max(slower) > MIN_SLOW_NOISE_CHANGE) and not is_short(problem.recording)


def base_torque_changed(problem: Problem, values: Array, members: Sequence[FittedEffect]) -> bool:
    """Whether the base model's torque beside what was found differs from that without by a share that effects feel.

    Effects that grow with load or friction were measured by a base model that had taken what it could of others. The
    torque beyond a limit is little of all: it differs by much where the base model does by little.
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
        before, after = (dense(p, member.hypothesis, member.shape) @ member.coefficients for p in (problem, now))
        if np.sum((after - before) ** 2) > MIN_EFFECT_CHANGE**2 * np.sum(before**2):
            return True
    return False


def _unusable_rows(problem: Problem, member: FittedEffect) -> NDArray[np.bool_] | None:
    """Rows (N, n) that an effect makes useless as measurements, by the log and by its torque; None if it makes none."""
    hypothesis = member.hypothesis
    flags = hypothesis.effect.gate(problem.situation, hypothesis.joint, problem.recording.tau)
    if flags is None:
        return None
    lost = np.abs(dense(problem, hypothesis, member.shape)).max(axis=2)
    return np.asarray(flags | (lost > CUT * lost.max()))


def _again(problem: Problem, members: Sequence[FittedEffect], k: int) -> FittedEffect:
    others = tuple(member.group for i, member in enumerate(members) if i != k)
    return refine(problem, members[k].hypothesis, members[k].shape, accept(problem, others))
