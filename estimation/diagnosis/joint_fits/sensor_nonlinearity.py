"""Joint fit of the base model and effects that distort the torque reading as a function of the torque."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect, accept_all_but
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.refinement import clip_shape, refine
from estimation.diagnosis.joint_fits.total_torque import JointFit
from robots.common.arrays import Array
from robots.terms.effect_bases.capabilities import Reading
from robots.terms.effect_bases.static import StaticJointEffect

STEPS, HALVINGS = 20, 6
"""Gauss-Newton iterations, and step halvings in each of them."""
ENOUGH = 1e-4
"""Relative decrease of the sum of squares below which the search ends."""


def fit_sensor_nonlinearity(problem: Problem, members: Sequence[FittedEffect]) -> tuple[Problem, list[FittedEffect]]:
    """Fits base model, effects and distortions of the torque reading together (Gauss-Newton).

    A base model fitted to the readings alone follows the distortion. The distortion computed from its torque is then
    too small, and alternating both fits need not converge. Here the columns of the base model are scaled by the
    derivative of the reading.

    Args:
        problem: data and base model.
        members: all effects; those that distort the reading are fitted here.

    Returns:
        The problem with the situation of the true torque, and the members with refitted distortions. Both are unchanged
        if no effect distorts.
    """
    wrong = [k for k, member in enumerate(members) if member.hypothesis.effect.reading is Reading.DISTORTS]
    found = list(members)
    if not wrong:
        return problem, found
    search = _Search(problem, [m for k, m in enumerate(members) if k not in wrong], [members[k] for k in wrong])
    problem, known = search.run()
    for k, member in zip(wrong, known, strict=True):
        found[k] = refine(problem, member.hypothesis, member.shape, accept_all_but(problem, found, k), effort=0)
    return problem, found


class _Search:
    """Gauss-Newton search for base parameters, nuisance, effect coefficients and distortions."""

    def __init__(self, problem: Problem, plain: Sequence[FittedEffect], wrong: Sequence[FittedEffect]) -> None:
        self.problem, self.wrong = problem, list(wrong)
        self.fit = JointFit(problem, plain, np.ones_like(problem.recording.sign_unknown))
        # Shape parameters with equal bounds are fixed.
        self.bounds = [_bounds(problem, member) for member in wrong]
        self.loose = [[k for k, (low, high) in enumerate(own) if low < high] for own in self.bounds]

    def run(self) -> tuple[Problem, list[FittedEffect]]:
        """Iterates until the sum of squares stops decreasing."""
        members, tau = self.wrong, self.problem.recording.tau
        values = self.fit.values(tau - self._distortion(self.problem, members))
        now = self._known(values)
        cost = self._cost(values, now, members)
        for _ in range(STEPS):
            goal = self._solved(values, now, members)
            before = cost
            for share in 0.5 ** np.arange(HALVINGS):
                tried, others = self._moved(values, members, goal, share)
                there = self._known(tried)
                cost = self._cost(tried, there, others)
                if cost < before:
                    values, members, now = tried, others, there
                    break
            if cost > (1.0 - ENOUGH) * before:
                break
        return now, members

    def _solved(self, values: Array, now: Problem, members: Sequence[FittedEffect]) -> Array:
        """Solves the linearised problem for all unknowns."""
        passes, more, own = np.ones_like(self.problem.recording.tau), [], [values]
        for member, loose in zip(members, self.loose, strict=True):
            effect, joint = member.hypothesis.effect, member.hypothesis.joint
            assert isinstance(effect, StaticJointEffect)
            assert joint is not None
            slopes = effect.slopes(now.situation, joint, member.coefficients, member.shape)
            passes[:, joint - 1] += slopes[:, 0]
            by_shape = np.zeros((*passes.shape, len(loose)))
            by_shape[:, joint - 1] = slopes[:, 1:][:, loose]
            more += [now.dense(member.hypothesis, member.shape), by_shape]
            own += [member.coefficients, np.asarray(member.shape)[loose]]
        columns = np.concatenate([self.fit.full, *more], axis=2)
        # The distortion is evaluated at the base model's torque, so only the base columns are scaled.
        columns[:, :, : self.problem.baseline.base.size] *= passes[:, :, None]
        left = self.problem.recording.tau - self.fit.full @ values - self._distortion(now, members)
        return self.fit.moments(left + columns @ np.concatenate(own), columns).posterior()

    def _moved(
        self, values: Array, members: Sequence[FittedEffect], goal: Array, share: float
    ) -> tuple[Array, list[FittedEffect]]:
        """Takes a share of the step to a solution."""
        at, moved = len(values), []
        for member, loose, bounds in zip(members, self.loose, self.bounds, strict=True):
            k, shape = len(member.coefficients), list(member.shape)
            coefficients = member.coefficients + share * (goal[at : at + k] - member.coefficients)
            for i, value in zip(loose, goal[at + k : at + k + len(loose)], strict=True):
                shape[i] += share * (float(value) - shape[i])
            moved.append(replace(member, coefficients=coefficients, shape=clip_shape(shape, bounds)))
            at += k + len(loose)
        return values + share * (goal[: len(values)] - values), moved

    def _known(self, values: Array) -> Problem:
        problem = self.problem
        now = problem.baseline.situation(problem.recording, values[: problem.baseline.base.size])
        return replace(problem, situation=now)

    def _distortion(self, now: Problem, members: Sequence[FittedEffect]) -> Array:
        return np.sum([m.torque(now) for m in members], axis=0)

    def _cost(self, values: Array, now: Problem, members: Sequence[FittedEffect]) -> float:
        """Returns the weighted sum of squares of residual, prior and reversal timing."""
        fit, problem, pull = self.fit, self.problem, self.problem.prior
        left = (problem.recording.tau - fit.full @ values - self._distortion(now, members)) * fit.weights
        off = values[: len(pull.target)] - pull.target
        cost = float(np.sum(left**2) + off @ pull.precision @ off)
        if problem.timing is not None:
            cost += float(np.sum((problem.timing.residual - fit.timed @ values) ** 2))
        return cost


def _bounds(problem: Problem, member: FittedEffect) -> tuple[tuple[float, float], ...]:
    return member.hypothesis.effect.bounds(problem.situation, member.hypothesis.joint)
