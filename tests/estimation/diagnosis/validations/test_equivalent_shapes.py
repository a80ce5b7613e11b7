"""Tests of the choice among shapes of an effect that fit about equally well."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimation.diagnosis.base_models.baseline import base_parameters, build_baseline
from estimation.diagnosis.calibration import MAX_SHAPE_CHI2
from estimation.diagnosis.experiment_plans.planned_limits import planned_problem
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.problem import Group, Problem
from estimation.diagnosis.hypothesis_tests.refinement import refine
from estimation.diagnosis.hypothesis_tests.scoring import Accepted, accept
from estimation.diagnosis.joint_fits.extended_fit import fit_extended
from estimation.diagnosis.recordings.log_reading import build_recording
from estimation.diagnosis.recordings.recording import Recording
from estimation.diagnosis.searches.selection import SelectedEffect
from estimation.diagnosis.validations.equivalent_shapes import complete_effects, equivalent_shapes
from estimation.models.extension import extension_torque
from robots.loading import load_robot
from robots.plants import Sensors
from robots.regressor import default_model
from robots.robot import Robot
from robots.signals import Log, Motion
from robots.terms.effects import EFFECTS

SPRING = Hypothesis(EFFECTS["spring"], 1)
NARROW = 0.35
NOISE = np.array([0.05, 0.1])


def _balancer(q: np.ndarray) -> np.ndarray:
    """Computes the torque of a spring of 1 kN/m between levers of 0.12 and 0.4 m, as the slope of its energy."""

    def energy(angle: np.ndarray) -> np.ndarray:
        length = np.sqrt(0.12**2 + 0.4**2 - 2 * 0.12 * 0.4 * np.cos(angle + 2.4))
        return 0.5 * 1e3 * (length - 0.2) ** 2

    return (energy(q + 1e-5) - energy(q - 1e-5)) / 2e-5


@pytest.fixture(scope="module")
def narrow(arm: Robot, arm_log: Callable[..., Log]) -> tuple[Recording, Recording]:
    """Returns a motion over few angles, and one over many, with the torque of an arm that is nearly as described."""
    whole = build_recording(arm, [arm_log(torque_noise=0.02)])
    base = base_parameters(arm, "coulomb-viscous", (0.001, 0.001))
    small = replace(whole, q=NARROW * whole.q, dq=NARROW * whole.dq, ddq=NARROW * whole.ddq)
    Y, Y_small = (build_baseline(base, data).regressor for data in (whole, small))
    values = np.linalg.lstsq(Y.reshape(-1, Y.shape[2]), whole.tau.reshape(-1), rcond=None)[0]
    return replace(small, tau=Y_small @ values), replace(whole, tau=Y @ values)


@pytest.mark.slow
def test_forms_of_a_spring_that_fit_alike_are_listed(
    pose_arm: Callable[..., Problem], narrow: tuple[Recording, Recording]
) -> None:
    """After a fit to a third of the range, several levers fit as well as the polynomial; the likeliest come first."""
    small, wide = narrow
    rng = np.random.default_rng(4)
    extra = np.column_stack([_balancer(small.q[:, 0]), 0 * small.t])
    problem = pose_arm(replace(small, tau=small.tau + extra + rng.normal(size=small.tau.shape) * NOISE))
    plain = refine(problem, SPRING, (0.0, 0.0, 3.0), accept(problem, ()), effort=0)
    forms = equivalent_shapes(problem, [plain], 0)
    assert len(forms) >= 2
    assert all(form.gain > plain.gain - MAX_SHAPE_CHI2 and form.shape != plain.shape for form in forms)
    # The likeliest shape, with the arm as described, predicts the unseen positions best.
    there = build_baseline(problem.baseline.base, wide)
    errors = []
    for form in (forms[0], forms[-1]):
        fit = fit_extended(problem, [form], {})
        values = fit.values[: there.base.size]
        completed = there.regressor @ values + extension_torque(fit.model.extensions, there.situation(wide, values))
        errors.append(np.sqrt(np.mean((wide.tau[:, 0] + _balancer(wide.q[:, 0]) - completed[:, 0]) ** 2)))
    assert errors[0] < errors[1]


def test_a_form_that_fits_worse_is_not_listed(
    pose_arm: Callable[..., Problem], narrow: tuple[Recording, Recording]
) -> None:
    """With data over the whole range a cable has no equivalent shape, and neither has an effect with one form."""
    _, wide = narrow
    q = wide.q[:, 0]
    rng = np.random.default_rng(5)
    extra = np.column_stack([3.0 * q + 4.0 * q**3, 0 * q])
    problem = pose_arm(replace(wide, tau=wide.tau + extra + rng.normal(size=wide.tau.shape) * NOISE))
    plain = refine(problem, SPRING, (0.0, 0.0, 3.0), accept(problem, ()), effort=0)
    assert equivalent_shapes(problem, [plain], 0) == []
    stribeck = refine(problem, Hypothesis(EFFECTS["stribeck"], 1), (0.1, 1.0), accept(problem, ()), effort=0)
    assert equivalent_shapes(problem, [stribeck], 0) == []


@pytest.mark.slow
def test_a_tilt_is_reported_beside_the_first_axis_own_moments() -> None:
    """With the first axis' moments fitted, tilt angles are within 3 standard errors; without them they are biased.

    The chance that one of the two angles is not is 1 in 180.
    """
    robot, rng = load_robot("ur10"), np.random.default_rng(8)
    t = 0.004 * np.arange(5000)
    rates = np.array([0.7, 1.1, 1.3, 1.7, 2.1, 2.6])
    q, dq, ddq = (0.6 * rates**k * f(np.outer(t, rates)) for k, f in enumerate((np.sin, np.cos, lambda x: -np.sin(x))))
    model = default_model(replace(robot, friction=np.full((6, 4), 3.0)), velocity_scale=2e-3)
    problem = planned_problem(model, model.nominal, [Motion(t, q, dq, ddq)], noise=Sensors(torque_noise=0.025))
    tilt = Hypothesis(EFFECTS["base_tilt"], None)
    angles, moments = np.array([0.012, -0.008]), (6.0, -4.0)
    posed = _Tilted(problem, tilt, np.kron([1.0, *moments], angles), rng.normal(size=6))
    plain = refine(posed, tilt, (0.0, 0.0), _nothing(), effort=0)  # type: ignore[arg-type]
    (completed,) = complete_effects(posed, [SelectedEffect(plain, 1e-9, ())])  # type: ignore[arg-type]
    assert plain.shape == (0.0, 0.0)
    # Standard errors of the angles beside the four columns of the moments.
    errors = np.sqrt(np.diag(np.linalg.pinv(posed.gram, rcond=1e-10, hermitian=True))[:2])
    assert np.all(np.abs(completed.effect.coefficients - angles) < 3 * errors)
    assert np.any(np.abs(plain.coefficients - angles) > 3 * errors)
    # The search for the moments reaches the gain of the true ones.
    true = refine(posed, tilt, moments, _nothing(), effort=0)  # type: ignore[arg-type]
    assert completed.effect.gain > true.gain - 0.1
    assert completed.effect.gain > plain.gain + 10.0
    # A small tilt is not worth two more parameters.
    posed = _Tilted(problem, tilt, 0.02 * np.kron([1.0, *moments], angles), 0.02 * rng.normal(size=6))
    plain = refine(posed, tilt, (0.0, 0.0), _nothing(), effort=0)  # type: ignore[arg-type]
    assert complete_effects(posed, [SelectedEffect(plain, 1e-9, ())])[0].effect is plain  # type: ignore[arg-type]


def _nothing() -> Accepted:
    return Accepted((), np.zeros((0, 0)), np.zeros(0))


class _Tilted:
    """A problem whose residual is the torque of a tilt plus noise, projected on the angles' and moments' columns.

    `values` (6,) are coefficients of the angles, and of the angles times each moment; `drawn` (6,) is standard normal.
    """

    def __init__(self, problem: Problem, tilt: Hypothesis, values: np.ndarray, drawn: np.ndarray) -> None:
        self.problem = problem
        plain, *own = (tilt.effect.columns(problem.situation, None, m) for m in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)))
        columns = np.concatenate([plain, *(X - plain for X in own)], axis=2)
        joints = tuple(range(columns.shape[1]))
        self.gram = problem.group(joints, tuple(columns[:, j] for j in joints)).gram
        roots, vectors = np.linalg.eigh(self.gram)
        self.cross = self.gram @ values + vectors @ (np.sqrt(np.maximum(roots, 0.0)) * drawn)

    def __getattr__(self, name: str) -> object:
        return getattr(self.problem, name)

    def measured(self, hypothesis: Hypothesis, shape: tuple[float, ...]) -> Group:
        group = self.problem.measured(hypothesis, shape)
        return replace(group, cross=np.kron([[1.0], *([m] for m in shape)], np.eye(2)).T @ self.cross)
