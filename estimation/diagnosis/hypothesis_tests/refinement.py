"""Continuous refinement of an effect's shape, its linear coefficients and the base model always refitted."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from estimation.diagnosis.calibration import ABSENT_CHI2, MAX_REVERSAL_CHI2, RARE_ODDS, REVERSAL_FORMULA_ERROR
from estimation.diagnosis.hypothesis_tests.evidence import Evidence
from estimation.diagnosis.hypothesis_tests.groups import Group
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.hypothesis_tests.joint_agreement import per_joint_evidence
from estimation.diagnosis.hypothesis_tests.problem import Problem
from estimation.diagnosis.hypothesis_tests.reversal_errors import gain_from_reversal_errors
from estimation.diagnosis.hypothesis_tests.scoring import Accepted, accept, score

Array = NDArray[np.float64]

# Evaluations a shape parameter.
EFFORT = 20
# Points of each look for a moment, and how far it reaches in steps of the one before; and a step of the search from
# there, as a share of the first. A sudden change has a narrow summit on a broad one: of one joint, where a look costs
# little, a wide one is taken between.
ZOOMS, AGAIN = ((21, 1.2), (11, 1.2), (11, 1.2)), 0.1
WIDE = (101, 6.0)
# First step of the search: a factor of a logarithmic parameter, a share of the range of another.
FACTOR, SHARE = 1.5, 0.04
# An effect acts where its torque is more than this share of its largest.
ACTS = 0.02
# Friction that would turn round over a shorter way than any, by this factor, turns round at once: late, if anything.
SHORT_TRAVEL_FACTOR = 1.05


@dataclass(frozen=True, eq=False)
class FittedEffect:
    """A hypothesis with its best shape, measured beside the base model and others.

    Attributes:
        hypothesis: effect and joint.
        shape: one value per shape parameter.
        group: its columns there.
        gain: squared residual explained beside the others, coefficients within their bounds.
        coefficients: (k,) beside the others.
        degrees: coefficients that show, and shape parameters that are free: one whose bounds are equal is known.
        visible: largest share of a column's energy that the model before leaves.
        birge_ratio: of what each joint says of a coefficient that all have alike, or rows beside reversals and others,
            as a variance over that of the noise and of the formula (Birge ratio, one at least): the gain counts for so
            much less.
        motion_error_chi2: part of that gain which errors of the motion may cause. It counts when causes are compared,
            and does not count as evidence that there is a cause.
    """

    hypothesis: Hypothesis
    shape: tuple[float, ...]
    group: Group
    gain: float
    coefficients: Array
    degrees: int
    visible: float
    birge_ratio: float = 1.0
    motion_error_chi2: float = 0.0

    @property
    def evidence(self) -> Evidence:
        """For it against other effects in its place."""
        prior = RARE_ODDS if self.hypothesis.effect.rare else 0.0
        rows = len(self.group.columns[0]) * len(self.group.joints)
        return Evidence(self.gain / self.birge_ratio, self.degrees, rows, prior)

    @cached_property
    def local_evidence(self) -> Evidence:
        """For it against no effect at all.

        A transient effect counts the rows in which it acts: the others are no data for its parameters.
        """
        known = self.evidence
        rows = min(known.rows, self._acting_rows()) if self.hypothesis.effect.transient else known.rows
        return replace(known, chi2=known.chi2 - self.motion_error_chi2, rows=rows)

    @property
    def bic_gain(self) -> float:
        """Of `evidence`."""
        return self.evidence.bic_gain

    @property
    def local_bic_gain(self) -> float:
        """Of `local_evidence`."""
        return self.local_evidence.bic_gain

    @property
    def excess_chi2(self) -> float:
        """What it explains above as many columns of noise; not negative."""
        return max(self.gain - self.degrees, 0.0)

    def _acting_rows(self) -> float:
        """Rows that the columns act on: (sum x^2)^2 / sum x^4, mean over columns, two at least."""
        whole = np.concatenate(self.group.columns).astype(float) ** 2
        square, fourth = whole.sum(axis=0), (whole**2).sum(axis=0)
        counts = square[fourth > 0] ** 2 / fourth[fourth > 0]
        return max(float(counts.mean()), 2.0) if len(counts) else np.inf

    def gain_on(self, joints: Collection[int]) -> float:
        """What of the gain is on some joints, counted from 0, by its torque's energy there."""
        energies = [float(np.sum((X @ self.coefficients) ** 2)) for X in self.group.columns]
        there = sum(e for j, e in zip(self.group.joints, energies, strict=True) if j in joints)
        return self.gain * there / max(sum(energies), 1e-300)

    def acts(self) -> NDArray[np.bool_]:
        """Marks the white rows (N,) in which its torque is more than next to nothing on a joint."""
        torques = [np.abs(part @ self.coefficients) for part in self.group.columns]
        return np.asarray(np.max([torque > ACTS * torque.max(initial=0.0) for torque in torques], axis=0))

    def share_beside(self, other: FittedEffect, joint: int) -> float:
        """Share of this torque's energy on a joint, from 0, in the rows in which another's acts there."""
        if joint not in self.group.joints or joint not in other.group.joints:
            return 0.0
        own, size = (np.abs(m.group.columns[m.group.joints.index(joint)] @ m.coefficients) for m in (self, other))
        acts = size > ACTS * size.max(initial=0.0)
        return float(np.sum(own[acts] ** 2) / max(np.sum(own**2), 1e-300))


def set_bic_gain(problem: Problem, members: Sequence[FittedEffect], beside: Sequence[FittedEffect] = ()) -> float:
    """BIC gain of members together, beside others that are in the model already."""
    cost = sum(member.gain - member.bic_gain for member in members)
    known = accept(problem, tuple(m.group for m in beside)).gain if beside else 0.0
    return accept(problem, tuple(m.group for m in (*beside, *members))).gain - known - cost


def accept_all_but(problem: Problem, members: Sequence[FittedEffect], i: int) -> Accepted:
    """Accepts all members but one."""
    return accept(problem, tuple(m.group for k, m in enumerate(members) if k != i))


def refine(
    problem: Problem, hypothesis: Hypothesis, start: tuple[float, ...], accepted: Accepted, *, effort: int = EFFORT
) -> FittedEffect:
    """Searches the shape that explains most for its number of parameters, from a point of the grid.

    The linear coefficients and the base model are projected out at every step (variable projection, Golub and Pereyra
    1973), so that the search has as many dimensions as the effect has shape parameters. Shapes that machines are built
    with are then tried, without a parameter to pay for.
    """
    situation = problem.state_for(hypothesis.effect)
    bounds = hypothesis.effect.bounds(situation, hypothesis.joint)
    scales = [shape.scale for shape in hypothesis.effect.shapes]
    loose = [k for k, (low, high) in enumerate(bounds) if high > low]
    moments = [shape.moment for shape in hypothesis.effect.shapes]
    best: list[FittedEffect] = []

    def evaluate(shape: tuple[float, ...], fitted: int | None = None) -> float:
        if fitted is None:
            fitted = sum(not hypothesis.effect.shapes[k].is_left(shape[k]) for k in loose)
        group = problem.measured(hypothesis, shape)
        result = score(problem, group, accepted)
        gain, coefficients = result.bounded(*hypothesis.coefficient_bounds(situation.robot, shape))
        member = FittedEffect(hypothesis, shape, group, gain, coefficients, result.degrees + fitted, result.visible)
        worth = member.bic_gain
        if not best or worth > best[0].bic_gain:
            best[:] = [member]
        # What is climbed has no step where a parameter that costs begins to count.
        return gain

    def search(free: list[int], start: tuple[float, ...]) -> None:
        at = list(start)
        steps = {k: _spacing(hypothesis.effect.grid(situation, hypothesis.joint), k, start) for k in free if moments[k]}

        def along(values: tuple[float, ...]) -> float:
            for k, value in zip(free, values, strict=True):
                at[k] = value
            return evaluate(tuple(at))

        for k, step in steps.items():
            sudden = len(free) == 1 and len(best[0].group.joints) == 1
            looks = (ZOOMS[0], WIDE, *ZOOMS[1:]) if sudden else ZOOMS
            _zoom(lambda value, k=k: evaluate((*at[:k], value, *at[k + 1 :])), at[k], step, bounds[k], looks)  # type: ignore[misc]
            at[:] = best[0].shape
        if len(steps) < len(free):
            first = [AGAIN * steps[k] if k in steps else None for k in free]
            limits, kinds = tuple(bounds[k] for k in free), [scales[k] for k in free]
            climb(along, tuple(at[k] for k in free), limits, kinds, effort, first)
            summit = best[0]
            others = hypothesis.effect.other_optima(situation, hypothesis.joint, summit.shape, summit.coefficients)
            for slopes in others:
                gains = [evaluate(slope) for slope in slopes]
                at[:] = slopes[int(np.argmax(gains))]
                climb(along, tuple(at[k] for k in free), limits, kinds, effort, first)

    if hypothesis.effect.acts_on_total_torque or hypothesis.effect.distorts:
        # What is known now may have been free, or another, where the search comes from.
        start = clip_shape(start, bounds)
    evaluate(start)
    if loose and effort:
        # What the effect is whole without comes last, from where the rest led.
        later = [k for k in loose if hypothesis.effect.shapes[k].is_left(start[k])]
        search([k for k in loose if k not in later], start)
        if later:
            search(loose, best[0].shape)
    if effort:
        refined = best[0]
        for known in hypothesis.effect.likely(situation, hypothesis.joint, refined.shape, refined.coefficients):
            shape = tuple(own if value is None else value for value, own in zip(known, refined.shape, strict=True))
            evaluate(shape, sum(known[k] is None for k in loose))
    found = best[0]
    if hypothesis.effect.lags:
        return _with_scatter(problem, found, accepted)
    if hypothesis.effect.acts_at_reversals and hypothesis.joint is not None:
        if found.shape[0] < SHORT_TRAVEL_FACTOR * bounds[0][0]:
            return replace(found, birge_ratio=np.inf)
        owed = gain_from_reversal_errors(problem, hypothesis.joint, found.group, found.gain, accepted)
        return replace(found, motion_error_chi2=owed)
    return (
        replace(found, birge_ratio=_reversal_scatter(problem, found, accepted))
        if hypothesis.effect.acceleration_driven
        else found
    )


def clip_shape(shape: Sequence[float], bounds: Sequence[tuple[float, float]]) -> tuple[float, ...]:
    """Brings each value of a shape into its bounds."""
    return tuple(min(max(value, low), high) for value, (low, high) in zip(shape, bounds, strict=True))


def _with_scatter(problem: Problem, member: FittedEffect, accepted: Accepted) -> FittedEffect:
    """Says how much less its gain counts where joints differ in what they share (Birge 1932), or tell by reversals."""
    evidence = per_joint_evidence(problem, member.hypothesis, member.shape, accepted)
    if not (acts := evidence.gram > 0).any():
        return member
    evidence = evidence.subset(acts)
    agreed = evidence.gain()
    scatter = max(1.0, float(evidence.cross.sum() ** 2 / evidence.gram.sum()) / agreed)
    return replace(member, birge_ratio=scatter, motion_error_chi2=max(0.0, agreed - evidence.gain(surely=True)))


def _reversal_scatter(problem: Problem, member: FittedEffect, accepted: Accepted) -> float:
    """How much more what an effect is beside reversals and elsewhere differ than they may by chance.

    Beside reversals accelerations are not known to all of their kicks. What is missing of them looks like an effect of
    the changes of acceleration, on every joint that feels them, and is the same at each.
    """
    parts = score(problem, problem.split(member.group, member.coefficients, problem.far_from_reversals), accepted)
    # What each part says of the whole, were it as large as it is: the base model may take of one what the other has.
    expected = parts.gram.sum(axis=1)
    if (expected <= 0).any():
        return 1.0
    sizes = parts.cross / expected
    if (1.0 - 2.0 * sizes[0]) / (parts.gram[0, 0] / expected[0] ** 2 + REVERSAL_FORMULA_ERROR**2) > ABSENT_CHI2:
        return np.inf
    difference = np.array([1.0, -1.0]) / expected
    return max(
        1.0,
        float((sizes[0] - sizes[1]) ** 2 / (difference @ parts.gram @ difference + REVERSAL_FORMULA_ERROR**2))
        / MAX_REVERSAL_CHI2,
    )


def _spacing(grid: Sequence[tuple[float, ...]], k: int, start: tuple[float, ...]) -> float:
    """Gives the larger distance of a point's moment to its neighbours on the grid, others alike."""
    near = [abs(point[k] - start[k]) for point in grid if point[:k] + point[k + 1 :] == start[:k] + start[k + 1 :]]
    near = sorted(distance for distance in near if distance > 0)
    return near[min(1, len(near) - 1)] if near else 1.0


def _zoom(
    evaluate: Callable[[float], float],
    start: float,
    width: float,
    bounds: tuple[float, float],
    looks: Sequence[tuple[int, float]],
) -> None:
    """Looks for a moment on points that get closer and closer: no method that climbs finds the top of a random walk."""
    for count, reach in looks:
        points = np.clip(start + width * np.linspace(-reach, reach, count), *bounds)
        gains = [evaluate(float(point)) for point in points]
        start, width = float(points[int(np.argmax(gains))]), 2 * reach * width / (count - 1)


def climb(
    evaluate: Callable[[tuple[float, ...]], float],
    start: tuple[float, ...],
    bounds: tuple[tuple[float, float], ...],
    scales: Sequence[str],
    effort: int,
    first: Sequence[float | None],
) -> None:
    """Nelder and Mead's simplex on logarithms where the scale is one, with first steps where they are given."""
    logs = [scale == "log" and low > 0 for scale, (low, _) in zip(scales, bounds, strict=True)]

    def forward(values: tuple[float, ...]) -> Array:
        return np.array([np.log(v) if is_log else v for v, is_log in zip(values, logs, strict=True)])

    low, high = forward(tuple(b[0] for b in bounds)), forward(tuple(b[1] for b in bounds))
    x0 = np.clip(forward(start), low, high)
    span = np.where(np.isfinite(high - low), high - low, 1.0)
    step = np.where(logs, np.minimum(np.log(FACTOR), 0.2 * span), SHARE * span)
    step = np.array([own if given is None else given for own, given in zip(step, first, strict=True)])
    simplex = np.vstack(
        [x0, *(x0 + np.where(x0[i] + step[i] > high[i], -1, 1) * step * unit for i, unit in enumerate(np.eye(len(x0))))]
    )

    def objective(x: Array) -> float:
        inside = np.clip(x, low, high)
        shape = tuple(float(np.exp(v)) if is_log else float(v) for v, is_log in zip(inside, logs, strict=True))
        return -evaluate(shape)

    minimize(
        objective,
        x0,
        method="Nelder-Mead",
        options={
            "initial_simplex": simplex,
            "maxfev": effort * len(x0),
            "xatol": 1e-3 * float(step.min()),
            "fatol": 1e-2,
        },
    )
