"""Tests of additional gear load: a spring that increases load-dependent friction."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from estimation import load_model
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Problem, build_problem
from estimation.diagnosis.hypothesis_tests.refinement import refine
from estimation.diagnosis.hypothesis_tests.scoring import accept
from estimation.diagnosis.joint_fits.extended_fit import fit_extended
from estimation.diagnosis.joint_fits.gear_load import NO_GEAR_LOAD, find_gear_load
from estimation.diagnosis.joint_fits.total_torque import fit_jointly
from estimation.diagnosis.recordings.log_reading import build_recording
from estimation.diagnosis.recordings.recording import Recording
from estimation.predictions.virtual_robot import virtual_robot
from robots.common.errors import InputError
from robots.robot import Robot
from robots.signals import Log, Motion
from robots.terms.effect_bases.gear_load import ExtraGearLoad, LoadSource
from robots.terms.effects import EFFECTS

SPRING, BY_LOAD, BY_PLACE = (
    Hypothesis(EFFECTS[name], 1) for name in ("spring", "load_dependent_friction", "position_dependent_friction")
)
SHARE = 0.15
"""Of the load, by which the shoulder's friction grows."""


def _pull(q: np.ndarray) -> np.ndarray:
    """Computes the torque of a hose at the shoulder [N m]."""
    return np.asarray(15.0 * q + 10.0 * q**3)


@pytest.fixture(scope="module")
def recording(arm: Robot, arm_log: Callable[..., Log], pinocchio_torque: Callable[..., np.ndarray]) -> Recording:
    """Returns a recording with a hose at the shoulder, whose torque adds to the gear's load and friction."""
    whole = build_recording(arm, [arm_log(torque_noise=0.01)])
    q, dq = whole.q[:, 0], whole.dq[:, 0]
    load = pinocchio_torque(arm, Motion(whole.t, whole.q, whole.dq, whole.ddq))[:, 0] + _pull(q)
    tau = whole.tau.copy()
    tau[:, 0] += _pull(q) + SHARE * np.abs(load) * np.tanh(dq / 1e-3)
    return replace(whole, tau=tau)


def _members(problem: Problem, *places: Hypothesis) -> list[FittedEffect]:
    """Refines effects beside each other, one after the other, twice."""
    found: list[FittedEffect] = []
    for place in (*places, *places):
        rest = [m for m in found if m.hypothesis != place]
        start = next((m.shape for m in found if m.hypothesis == place), place.effect.grid(problem.situation, 1)[0])
        found = [*rest, refine(problem, place, start, accept(problem, tuple(m.group for m in rest)))]
    return sorted(found, key=lambda m: places.index(m.hypothesis))


@pytest.mark.slow
def test_a_friction_by_the_load_is_asked_for_with_the_spring_that_the_gear_bears(
    recording: Recording, pose_arm: Callable[..., Problem]
) -> None:
    """Load-dependent friction fits better with the spring in the gear load than position-dependent friction without."""
    problem = pose_arm(recording)
    found = _members(problem, SPRING, BY_PLACE)
    load_found = find_gear_load(problem, found, fit_jointly(problem, found)[0])
    assert load_found.improves_fit
    assert load_found.extra_load is not None
    (weight,) = load_found.extra_load.sources
    assert (weight.effect.name, weight.joint, weight.shape) == ("spring", 1, found[0].shape)


@pytest.mark.slow
def test_the_load_is_what_base_model_and_spring_have_together(
    arm: Robot,
    recording: Recording,
    pose_arm: Callable[..., Problem],
    pinocchio_torque: Callable[..., np.ndarray],
) -> None:
    """The gear load with the spring is accurate to 2 %; without it the error is above 10 %."""
    problem = pose_arm(recording)
    found = _members(problem, SPRING, BY_LOAD)
    values = fit_jointly(problem, found)[0]
    load_found = find_gear_load(problem, found, values)
    assert load_found.extra_load is not None
    alone = problem.baseline.situation(recording, values[: problem.baseline.base.size])
    motion = Motion(recording.t, recording.q, recording.dq, recording.ddq)
    true = pinocchio_torque(arm, motion)[:, 0] + _pull(recording.q[:, 0])
    # Compared without the mean, because a constant torque is part of the offset.
    errors = [load[:, 0] - true for load in (load_found.extra_load.on(alone).load, alone.load)]
    errors = [float(np.std(error) / true.std()) for error in errors]
    assert errors[0] < 0.02
    assert errors[1] > 0.1


@pytest.mark.slow
def test_the_model_is_what_was_fitted_with_a_load_that_the_gear_bears(
    recording: Recording, pose_arm: Callable[..., Problem], tmp_path: Path
) -> None:
    """The model's torque, also after saving, is that of base model, spring and friction; the share is the true one."""
    problem = pose_arm(recording)
    found = _members(problem, SPRING, BY_LOAD)
    values, left, full = fit_jointly(problem, found)
    extra = full[:, :, len(problem.prior.target) :] @ values[len(problem.prior.target) :]
    posed = build_problem(
        recording,
        problem.baseline,
        problem.whitening,
        extra=extra,
        bearing=find_gear_load(problem, found, values).extra_load,
    )
    members = _members(posed, SPRING, BY_LOAD)
    assert np.std(fit_jointly(posed, members)[1][~recording.sign_unknown[:, 0], 0]) < np.std(
        left[~recording.sign_unknown[:, 0], 0]
    )
    fitted = fit_extended(posed, members, {"gravities": []})
    by_load = fitted.model.extensions[1]
    error = float(np.sqrt(by_load.covariance[0, 0]))
    assert abs(by_load.coefficients[0] - SHARE) < max(3 * error, 0.03 * SHARE)
    expected = posed.baseline.regressor @ fitted.values[: posed.baseline.base.size]
    for member, extension in zip(members, fitted.model.extensions, strict=True):
        expected = expected + posed.dense(member.hypothesis, member.shape) @ extension.coefficients
    motion = (recording.q, recording.dq, recording.ddq, recording.t)
    fitted.model.save(tmp_path / "model.json")
    for model in (fitted.model, load_model(tmp_path)):
        np.testing.assert_allclose(model.torque(*motion), expected, rtol=0, atol=1e-8 * recording.tau.std())
        played = virtual_robot(model).torque(Motion(recording.t, *motion[:3]))
        np.testing.assert_allclose(played, expected, rtol=0, atol=1e-8 * recording.tau.std())
    without = replace(fitted.model, bearing=None).torque(*motion)
    assert np.abs(without - expected).max() > 1e-3 * recording.tau.std()
    data = json.loads((tmp_path / "model.json").read_text())
    weight = data["borne_by_gears"]["weights"][0]
    for wrong, message in (
        ({"how": "some"}, "how is 'some'.*effects, preloads"),
        ({"weights": [{**weight, "effect": "stribeck"}]}, "stribeck on joint 1"),
        ({"weights": [{**weight, "coefficients": [1.0]}]}, "values of spring that do not fit"),
        ({"weights": None}, "damaged"),
    ):
        other = {**data, "borne_by_gears": {**data["borne_by_gears"], **wrong}}
        (tmp_path / "model.json").write_text(json.dumps(other))
        with pytest.raises(InputError, match=message):
            load_model(tmp_path)


@pytest.mark.slow
def test_nothing_is_carried_of_what_no_gear_feels(recording: Recording, pose_arm: Callable[..., Problem]) -> None:
    """Friction does not load a gear; a spring does, but improves no fit without load-dependent effects."""
    problem = pose_arm(recording)
    (friction,) = _members(problem, BY_LOAD)
    assert find_gear_load(problem, [friction], fit_jointly(problem, [friction])[0]) is NO_GEAR_LOAD
    (spring,) = _members(problem, SPRING)
    load_found = find_gear_load(problem, [spring], fit_jointly(problem, [spring])[0])
    assert load_found.extra_load is not None
    assert not load_found.improves_fit


def test_a_spring_that_preloads_its_gear_has_the_offset(recording: Recording, pose_arm: Callable[..., Problem]) -> None:
    """The base model's offset is part of the gear load on the joint of a spring, if the spring preloads it."""
    now = pose_arm(recording).situation
    weight = LoadSource(EFFECTS["spring"], 1, (0.0, 0.0, 3.0), np.array([3.0, 0.0, 2.0, 0.0]))
    q = recording.q[:, 0]
    offset = (now.torque - now.rigid - now.friction)[:, 0]
    plain, all_of_it = (ExtraGearLoad(how, [weight]).on(now).load - now.load for how in ("effects", "preloads"))
    np.testing.assert_allclose(plain[:, 0], 3.0 * q + 2.0 * q**3)
    np.testing.assert_allclose(all_of_it[:, 0], plain[:, 0] + offset)
    assert not plain[:, 1].any()
    assert not all_of_it[:, 1].any()
