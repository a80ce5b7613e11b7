"""One cause that explains why the torques do not fit: columns, a unit, coupled axes, the base, missing gravity."""

from __future__ import annotations

from itertools import combinations
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from estimation.gate.candidates.any_arm import any_arm
from estimation.gate.candidates.candidate_fits import STANDARD, CandidateFits, Meaning, mean_log
from estimation.gate.candidates.causes import Cause, coupled, gravities, signs, units
from estimation.gate.candidates.torque_evidence import joint_evidence
from estimation.gate.candidates.torque_hypotheses import hypotheses
from estimation.gate.check import Check
from estimation.gate.context import Context, Stage
from estimation.gate.finding import Finding
from estimation.gate.quick_fits.whole_fit import POOR
from robots.common.plain import joints_in_words, percent, two_digits
from robots.robot import Robot

Array = NDArray[np.float64]

# Held-out error over the torque's standard deviation (geometric mean of the joints), below which columns and units are
# right, and below which gravity is right as well.
WELL, VERY_WELL = 0.1, 0.04
# Held-out error of a single joint over its torque's standard deviation, from which columns and units are doubted.
DOUBTFUL = 0.2
# Decrease of the error from which an exchange of columns is followed up, and by which an axis may be worse than the
# refined direction of gravity.
FOLLOWED, SNAP = 0.01, 0.02
# Decrease of the held-out error (mean log), for a warning and for a refusal, and that by other columns or units.
# Right simulated logs, with descriptions that are 20 % off, stay below 0.05, and measured ones below 0.35.
BETTER, CERTAIN, OTHER_COLUMNS = 0.15, 0.4, 0.4
# A log is of another robot if so many joints, one of them poorly explained, have less than this share of their error
# with a model of any arm.
JOINTS, HALF = 2, 0.5
# Findings that explain a bad fit already.
EXPLAINED = ("motor_side_position", "static_poses", "unit_of_position", "unit_of_time", "wrapped_angle")


class LikelyCauses(Check):
    """Fits the log under other meanings, and reports the one that explains the torques best.

    All meanings are compared by the same number: the held-out error of all joints together. Nothing is reported if a
    change of sign explains as much, which other checks report.
    """

    name: ClassVar[str] = "likely_causes"
    stage: ClassVar[Stage] = Stage.FITTED
    order: ClassVar[int] = 15

    def run(self, context: Context) -> list[Finding]:
        """Reports at most one cause."""
        before = context.smoothed.choice.cost
        doubtful = before > np.log(WELL) or float(np.nanmax(context.fitted.unexplained, initial=0.0)) > DOUBTFUL
        explained = any(finding.severity != "info" for finding in context.found(EXPLAINED))
        if explained or (before < np.log(VERY_WELL) and not doubtful):
            return []
        fits = CandidateFits(context.fitted)
        before = fits.cost(Meaning())
        causes = gravities(fits)
        if doubtful:
            bad = np.flatnonzero(context.fitted.unexplained > DOUBTFUL).tolist()
            causes += _sizes(context) + coupled(context.robot, bad)
            causes += [_ordered(fits, before, bad), *units(context.robot, bad), *signs(context.robot, bad)]
        found = _best(fits, causes, before)
        if found is not None:
            found = _refined(fits, *found)
        best = Meaning() if found is None else found[0].meaning
        left = np.minimum(fits.unexplained(best), 1.0)
        if (other := _other_robot(context, best, left)) is not None:
            return [other]
        mended = (context.fitted.unexplained >= POOR) & (left < POOR)
        context.explained = frozenset((np.flatnonzero(mended) + 1).tolist())
        if found is None or found[0].kind in ("sign", "size"):
            return []
        cause, after = found
        return [_finding(context, cause, before - after)]


def _other_robot(context: Context, best: Meaning, left: Array) -> Finding | None:
    """Names a log that the best meaning does not explain, but any other arm does.

    A single joint may have an effect of its position, as a spring, that the robot's model lacks and that of any arm
    has. It is no other robot.
    """
    if not (left >= POOR).any():
        return None
    other = np.minimum(any_arm(context.fitted), 1.0)
    other = other if best.tau_from is None else other[best.tau_from]
    wrong = np.flatnonzero(other < HALF * left)
    better = mean_log(left) - mean_log(other)
    if len(wrong) < JOINTS or not (left[wrong] >= POOR).any() or better < BETTER:
        return None
    shares = [_range(errors[wrong]) for errors in (left, other)]
    return Finding(
        name="other_robot",
        severity="refuse" if better > CERTAIN else "warning",
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
    evidence = joint_evidence(context.fitted)
    for best in hypotheses(context.robot, evidence)[:1] if evidence else []:
        if best.odds > 0 and best.kind in ("current", "motor", "percent", "unit"):
            factors = np.ones(context.robot.n)
            factors[list(best.joints)] = 1.0 / np.array(best.factors)
            return [Cause("size", Meaning(tau_factor=factors))]
    return []


def _best(fits: CandidateFits, causes: list[Cause], before: float) -> tuple[Cause, float] | None:
    """Gives the cause with the smallest error, if that is clearly smaller than before."""
    few = np.array([fits.cost(cause.meaning, few=True) for cause in causes])
    found = None
    for place in np.argsort(few)[:3]:
        after = fits.cost(causes[place].meaning)
        least = OTHER_COLUMNS if causes[place].kind in ("order", "unit", "coupled") else BETTER
        if before - after > least and (found is None or after < found[1]):
            found = causes[place], after
    weightless = [cause for cause in causes if cause.kind == "weightless"]
    # Gravity along the axes of a planar arm acts on no joint.
    if found is not None and found[0].kind == "gravity" and weightless:
        costs = [fits.cost(cause.meaning) for cause in weightless]
        if min(costs) < found[1] + SNAP:
            found = weightless[int(np.argmin(costs))], min(costs)
    return found


def _refined(fits: CandidateFits, cause: Cause, after: float) -> tuple[Cause, float]:
    """Refines a direction of gravity; one along an axis of the base frame is preferred if it explains as much."""
    if cause.kind != "gravity":
        return cause, after
    assert cause.meaning.gravity is not None
    refined = fits.refined_gravity(cause.meaning.gravity)
    cost = fits.cost(Meaning(gravity=refined))
    if after < cost:
        refined, cost = cause.meaning.gravity, after
    # What does not act on any joint, as gravity along the axes of a planar arm, is not made up.
    axes = [sign * STANDARD * axis for axis in np.eye(3) for sign in (1.0, -1.0)]
    costs = [fits.cost(Meaning(gravity=axis)) for axis in axes]
    if min(costs) < cost + SNAP:
        refined = axes[int(np.argmin(costs))]
    return Cause("gravity", Meaning(gravity=refined)), cost


def _finding(context: Context, cause: Cause, better: float) -> Finding:
    smaller = 100 * float(1 - np.exp(-better))
    severity = "refuse" if better > CERTAIN else "warning"
    if cause.kind == "gravity":
        assert cause.meaning.gravity is not None
        values = ",".join(f"{component:.3g}" for component in np.round(cause.meaning.gravity, 2) + 0.0)
        return Finding(
            name="gravity_direction",
            severity=severity,  # type: ignore[arg-type]
            text="the base seems to be mounted otherwise than described: errors are "
            f"{smaller:.3g} % smaller with gravity along ({values}) m/s2 in the base frame",
            action=f"state it with --gravity K={values} (K: the number of the log, from 1)",
            value=smaller,
            unit="%",
        )
    if cause.kind == "weightless":
        return without_gravity(
            f"errors are {smaller:.3g} % smaller if the torques carry no gravity", smaller, "%", better > CERTAIN
        )
    if cause.kind == "coupled":
        return _coupling_finding(context.robot, cause, severity, smaller)
    if cause.kind == "unit":
        assert cause.meaning.q_factor is not None
        factor = float(cause.meaning.q_factor[cause.joint])
        unit = {True: "degrees", False: "turned into radians twice"}[factor < 1]
        if context.robot.chain.kinds[cause.joint] == "prismatic":
            unit = {True: "millimetres", False: "turned into metres twice"}[factor < 1]
        scale = ", ".join(f"{value:.5g}" for value in cause.meaning.q_factor)
        return Finding(
            name="unit_of_position",
            severity=severity,  # type: ignore[arg-type]
            text=f"only this joint's position seems to be in another unit ({unit}): errors are then {smaller:.3g} % "
            "smaller",
            action=f"state `scale: [{scale}]` for the position in a mapping (--mapping)",
            value=factor,
            column=f"q{cause.joint + 1}",
            joint=cause.joint + 1,
        )
    return _order_finding(cause.meaning, severity, smaller, context.cleaned.columns.prefix)


def _coupling_finding(robot: Robot, cause: Cause, severity: str, smaller: float) -> Finding:
    assert cause.meaning.coupling is not None
    outer = cause.joint
    row = cause.meaning.coupling[outer]
    (inner,) = (k for k in np.flatnonzero(row) if k != outer)
    sign = "+" if row[inner] > 0 else "-"
    torques = " and `coupled_torques: true`" if cause.meaning.coupled_torques else ""
    return Finding(
        name="coupled_axes",
        severity=severity,  # type: ignore[arg-type]
        text=f"the position of joint {outer + 1} seems to be q{outer + 1} {sign} q{inner + 1}, as of an axis that is "
        f"driven by a parallelogram or counted against the base: errors are then {smaller:.3g} % smaller",
        action=f"state `coupling: {{{outer + 1}: {{{inner + 1}: {row[inner]:g}}}}}`{torques} in a mapping (--mapping)",
        value=smaller,
        unit="%",
        column=f"q{outer + 1}",
        joint=outer + 1,
    )


def _order_finding(meaning: Meaning, severity: str, smaller: float, prefix: str) -> Finding:
    lists, words = [], []
    key = "torque" if prefix == "tau" else "current"
    for name, column, source in (("position", "q", meaning.q_from), (key, prefix, meaning.tau_from)):
        assert source is not None
        if not np.array_equal(source, np.arange(len(source))):
            words.append(f"{name}s")
            lists.append(f"{name}: {{columns: [{', '.join(f'{column}{k + 1}' for k in source)}]}}")
    return Finding(
        name="swapped_columns",
        severity=severity,  # type: ignore[arg-type]
        text=f"the columns of {' and '.join(words)} seem to be in another order: errors are {smaller:.3g} % smaller "
        f"with {'; '.join(lists)}",
        action="state this order in a mapping (--mapping), or correct the logger",
        value=smaller,
        unit="%",
    )


def without_gravity(why: str, value: float, unit: str, certain: bool) -> Finding:
    """Gives the finding of torques without gravity."""
    return Finding(
        name="torque_meaning",
        severity="refuse" if certain else "warning",
        text=f"the torques seem to be without gravity, as those of a controller that compensates it: {why}",
        action="state --torque-is without-gravity (or `torque_is: without-gravity` in a mapping): the gravity of the "
        "robot's description is then added",
        value=value,
        unit=unit,
    )
