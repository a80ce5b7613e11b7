"""One cause that explains why the torques do not fit: columns, a unit, coupled axes, the base, missing gravity."""

from __future__ import annotations

from itertools import combinations
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from estimation.gate.candidates.any_arm import any_arm
from estimation.gate.candidates.candidate_fits import STANDARD, CandidateFits, Meaning, mean_log
from estimation.gate.candidates.cause_findings import cause_findings
from estimation.gate.candidates.causes import Cause, coupled, gravities, signs, torque_units, units
from estimation.gate.candidates.torque_evidence import joint_evidence
from estimation.gate.candidates.torque_hypotheses import hypotheses
from estimation.gate.check import Check
from estimation.gate.context import Context, Stage
from estimation.gate.finding import Finding
from robots.common.plain import joints_in_words, percent, two_digits

Array = NDArray[np.float64]

# Held-out error over the torque's standard deviation (geometric mean of the joints), below which columns and units are
# right, and below which gravity is right as well.
WELL, VERY_WELL = 0.1, 0.04
# Held-out error of a single joint over its torque's standard deviation, from which columns and units are doubted.
DOUBTFUL = 0.2
# Decrease of the error from which an exchange of columns is followed up, and by which a simpler cause may be worse than
# the best.
FOLLOWED, SNAP = 0.01, 0.02
# Least decrease of the held-out error (mean log) by another gravity or unit of all torques, and by other columns. Right
# simulated logs, with descriptions that are 20 % off, stay below 0.05, and measured ones below 0.35.
BETTER, OTHER_COLUMNS = 0.15, 0.4
# Standard errors of the gain, over the folds, from which another meaning is certain.
SURE = 5.0
# A log is of another robot if so many joints, one of them doubtful, have less than this share of their error with a
# model of any arm.
JOINTS, HALF = 2, 0.5


class LikelyCauses(Check):
    """Fits the log under other meanings, and reports the one that explains the torques best.

    All meanings are compared by the same number: the held-out error of all joints together. A log is refused only if
    it does not fit as it is, and every joint fits well with the other meaning, in all parts of the log. The checks that
    follow see the log as it is meant.
    """

    name: ClassVar[str] = "likely_causes"
    stage: ClassVar[Stage] = Stage.FITTED
    order: ClassVar[int] = 15

    def run(self, context: Context) -> list[Finding]:
        """Reports at most one cause."""
        fits = CandidateFits(context.logged)
        logged = fits.fit(Meaning())
        before = logged.unexplained
        doubtful = mean_log(before) > np.log(WELL) or float(np.nanmax(before, initial=0.0)) > DOUBTFUL
        if mean_log(before) < np.log(VERY_WELL) and not doubtful:
            return []
        causes = gravities(fits)
        if doubtful:
            bad = np.flatnonzero(before > DOUBTFUL).tolist()
            # A wrong sign may show at the joints that share the links.
            causes += signs(context.robot, np.flatnonzero(np.isfinite(before)).tolist())
            causes += [_ordered(fits, mean_log(before), bad), *units(context.robot, bad), *coupled(fits, bad)]
            causes += [*torque_units(context.robot), *_sizes(context)]
        found = _best(fits, causes, mean_log(before))
        found = None if found is None else _refined(fits, found)
        best = Meaning() if found is None else found.meaning
        meant = fits.fit(best)
        after = np.minimum(meant.unexplained, 1.0)
        if (other := _other_robot(context, best, after)) is not None:
            return [other]
        if found is None:
            return []
        context.meaning = found.meaning
        better = mean_log(np.minimum(before, 1.0)) - mean_log(after)
        misfit = float(np.nanmax(before)) > DOUBTFUL or better > -np.log(HALF)
        certain = misfit and float(np.nanmax(after)) < WELL and _better_everywhere(logged.by_fold, meant.by_fold)
        return cause_findings(context.robot, context.cleaned.columns.prefix, found, better, certain)


def _better_everywhere(before: Array, after: Array) -> bool:
    """Whether the errors of the joints in the folds (n, F) become smaller by much more than the folds differ."""
    gains = np.log(np.maximum(before, 1e-9)) - np.log(np.maximum(after, 1e-9))
    known = np.isfinite(gains)
    mean = np.where(known, gains, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    mean = mean[known.any(axis=0)]
    return len(mean) > 1 and float(mean.mean()) > SURE * float(mean.std(ddof=1)) / np.sqrt(len(mean))


def _other_robot(context: Context, best: Meaning, left: Array) -> Finding | None:
    """Names a log that the best meaning does not explain, but any other arm does.

    A single joint may have an effect of its position, as a spring, that the robot's model lacks and that of any arm
    has. It is no other robot.
    """
    if not (left >= DOUBTFUL).any():
        return None
    other = np.minimum(any_arm(context.logged), 1.0)
    other = other if best.tau_from is None else other[best.tau_from]
    wrong = np.flatnonzero(other < HALF * left)
    better = mean_log(left) - mean_log(other)
    if len(wrong) < JOINTS or not (left[wrong] >= DOUBTFUL).any() or better < BETTER:
        return None
    shares = [_range(errors[wrong]) for errors in (left, other)]
    return Finding(
        name="other_robot",
        severity="refuse" if mean_log(other) < np.log(WELL) else "warning",
        text="the log does not fit this robot's description, and may be of another robot: it leaves "
        f"{shares[0]} of the torques of {joints_in_words(wrong + 1)} unexplained, a model of any arm {shares[1]}",
        action="check --robot, and the axes and zeros of the joints in its description; no other order, sign, unit or "
        "gravity that was tried explains the log; if the robot is right, look for missing effects with oed diagnose",
        value=100 * float(1 - np.exp(-better)),
        unit="%",
    )


def _range(shares: Array) -> str:
    return f"{two_digits(100 * shares.min())} to {percent(shares.max())}"


def _ordered(fits: CandidateFits, before: float, bad: list[int]) -> Cause:
    """Finds the order of the columns with the smallest error, by exchanging two joints at a time.

    The columns of positions, of torques, or of both are exchanged. One of the joints must be a bad one. The search
    also starts from the reversed order and from rotated ones.
    """
    straight = np.arange(fits.robot.n)
    both = [straight, straight[::-1], np.roll(straight, 1), np.roll(straight, -1)]
    starts = [(order, order) for order in both[: 1 if fits.robot.n < 3 else None]]
    best, lowest = (straight, straight), before
    kinds = (True, True), (True, False), (False, True)
    for start in starts:
        q, tau = start
        cost = before if start is starts[0] else fits.cost(Meaning(q_from=q, tau_from=tau), few=True)
        allowed = kinds if start is starts[0] else kinds[:1]
        if cost > before + FOLLOWED:
            continue
        for _ in range(fits.robot.n):
            tried = []
            for pair in combinations(range(fits.robot.n), 2):
                if not set(pair) & set(bad):
                    continue
                swap = straight.copy()
                swap[list(pair)] = pair[::-1]
                # Torques last: the regressor of the same positions is used again.
                for kind in allowed:
                    order = (q[swap] if kind[0] else q, tau[swap] if kind[1] else tau)
                    tried.append((fits.cost(Meaning(q_from=order[0], tau_from=order[1]), few=True), kind, order))
            if not tried or min(one[0] for one in tried) > cost - FOLLOWED:
                break
            cost, kind, (q, tau) = min(tried, key=lambda one: one[0])
            allowed = (kind,)
        if cost < lowest:
            best, lowest = (q, tau), cost
    return Cause("order", Meaning(q_from=best[0], tau_from=best[1]))


def _sizes(context: Context) -> list[Cause]:
    """Lists torques of the described size, if the description has links and some joints are far from it."""
    if not context.robot.has_masses:
        return []
    evidence = joint_evidence(context.logged)
    for best in hypotheses(context.robot, evidence)[:1] if evidence else []:
        if best.odds > 0 and best.kind in ("current", "motor", "percent", "unit"):
            factors = np.ones(context.robot.n)
            factors[list(best.joints)] = 1.0 / np.array(best.factors)
            return [Cause("size", Meaning(tau_factor=factors))]
    return []


def _best(fits: CandidateFits, causes: list[Cause], before: float) -> Cause | None:
    """Gives the cause with the smallest error, if that is clearly smaller than before."""
    few = np.array([fits.cost(cause.meaning, few=True) for cause in causes])
    found, lowest = None, np.inf
    for place in np.argsort(few)[:3]:
        after = fits.cost(causes[place].meaning)
        least = BETTER if causes[place].kind in ("gravity", "weightless", "torque_unit") else OTHER_COLUMNS
        if before - after > least and after < lowest:
            found, lowest = causes[place], after
    weightless = [cause for cause in causes if cause.kind == "weightless"]
    # Gravity along the axes of a planar arm acts on no joint.
    if found is not None and found.kind == "gravity" and weightless:
        costs = [fits.cost(cause.meaning) for cause in weightless]
        if min(costs) < lowest + SNAP:
            found = weightless[int(np.argmin(costs))]
    return found


def _refined(fits: CandidateFits, cause: Cause) -> Cause:
    """Refines a direction of gravity; one along an axis of the base frame is preferred if it explains as much."""
    if cause.kind != "gravity":
        return cause
    assert cause.meaning.gravity is not None
    # What does not act on any joint, as gravity along the axes of a planar arm, is not made up.
    axes = [sign * STANDARD * axis for axis in np.eye(3) for sign in (1.0, -1.0)]
    free = [fits.refined_gravity(cause.meaning.gravity), cause.meaning.gravity]
    costs = [fits.cost(Meaning(gravity=direction)) for direction in (*free, *axes)]
    if min(costs[2:]) < min(costs[:2]) + SNAP:
        return Cause("gravity", Meaning(gravity=axes[int(np.argmin(costs[2:]))]))
    return Cause("gravity", Meaning(gravity=free[int(np.argmin(costs[:2]))]))
