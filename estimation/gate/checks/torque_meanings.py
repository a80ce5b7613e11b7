"""What the torque column means, by the torques of the robot's description."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar

import numpy as np

from estimation.gate.candidates.cause_findings import without_gravity
from estimation.gate.candidates.torque_evidence import JointEvidence, joint_evidence
from estimation.gate.candidates.torque_hypotheses import GEARED, Hypothesis, hypotheses
from estimation.gate.check import Check
from estimation.gate.context import Context, Stage
from estimation.gate.finding import Finding
from estimation.gate.quick_fits.whole_fit import LIKE_A_CONSTANT
from robots.common.plain import joints_in_words, percent, two_digits
from robots.robot import Robot

# Log of the odds against joint torques, from which another meaning is a warning, and from which it is refused.
LIKELY, CERTAIN = 8.0, 25.0
# Log of the odds up to which another meaning is as likely as the best, and is named beside it.
CLOSE = 8.0
# Unexplained share of the torques of half of the joints and of all, and share of friction, up to which torques are
# computed and not measured.
COMPUTED, AT_MOST, FRICTIONLESS = 0.005, 0.05, 0.12
# Factor on the described torques below which they may be what a controller has left of them. Drives have friction.
SUBTRACTED = 0.5
# Findings that explain the torques already.
EXPLAINED = (
    "delay",
    "gravity_direction",
    "motor_side_position",
    "other_robot",
    "static_poses",
    "swapped_columns",
    "torque_meaning",
    "unit_of_position",
    "unit_of_time",
    "wrapped_angle",
)
# The meanings in a few words.
OTHERWISE = {
    "current": "currents",
    "external": "external torques",
    "motor": "the torque of the motor on some joints",
    "percent": "torques in percent",
    "unit": "currents",
    "weightless": "torques without gravity",
}
# Nominal error over the torque's RMS, from which it is reported by itself, if this share is unexplained at most.
NOMINAL, WELL = 3.0, 0.3


class TorqueMeanings(Check):
    """Compares what the torque columns may hold: joint torques, currents, another unit, motor or external torques.

    Each meaning predicts the torques from the robot's description, within the description's errors. The meaning with
    the largest evidence is reported if it is much more likely than joint torques.
    """

    name: ClassVar[str] = "torque_meanings"
    stage: ClassVar[Stage] = Stage.FITTED
    order: ClassVar[int] = 65

    def run(self, context: Context) -> list[Finding]:
        """Reports one meaning at most, or large nominal errors without one."""
        explained = any(finding.severity != "info" for finding in context.found(EXPLAINED))
        if not context.robot.has_masses or explained:
            return []
        if context.cleaned.columns.prefix != "tau" or not (context.logged.unexplained < LIKE_A_CONSTANT).any():
            return []
        evidence = joint_evidence(context.logged)
        if not evidence:
            return []
        if (found := _computed(context, evidence)) is not None:
            return [found]
        best, *others = hypotheses(context.robot, evidence)
        # Another check reports signs.
        if best.odds <= LIKELY or best.kind == "sign":
            return _nominal(context, evidence)
        finding = _finding(context.robot, best)
        close = {
            OTHERWISE[other.kind] for other in others if other.odds > best.odds - CLOSE and other.kind in OTHERWISE
        }
        if best.kind in ("current", "motor", "unit") and max(best.factors) < SUBTRACTED and _frictionless(evidence):
            close.add(OTHERWISE["external"])
        close -= {OTHERWISE[best.kind]}
        also = f" (about as likely: {', '.join(sorted(close))})" if close else ""
        return [replace(finding, text=finding.text + also)]


def _finding(robot: Robot, best: Hypothesis) -> Finding:
    factors = [two_digits(factor) for factor in best.factors]
    # Another unit has one factor for all joints.
    listed = factors[0] if len(set(factors)) == 1 else ", ".join(factors)
    named = ",".join(str(joint + 1) for joint in best.joints)
    why = f"they are about {listed} times the described torques of "
    why += joints_in_words(joint + 1 for joint in best.joints)
    some = "" if len(best.joints) == robot.n else f":{named}"
    gears = np.abs(np.asarray(robot.gear_ratio, dtype=float))[list(best.joints)]
    if best.kind == "weightless":
        reason = "the described torques without gravity fit them better than those with it"
        return without_gravity(reason, best.odds, "", best.odds > CERTAIN)
    if best.kind == "external":
        return Finding(
            name="torque_meaning",
            severity="refuse" if best.odds > CERTAIN else "warning",
            text="the column seems to hold external torques, such as tau_ext: the described torques are not in it, "
            "at any scale",
            action="log the torque or current of the drives; the controller has subtracted its own model from this "
            "column",
            value=best.odds,
        )
    if best.kind == "motor":
        where = "on some joints" if some else "on all joints"
        if (gears > GEARED).all():
            stated = ", ".join(f"{gear:.4g}" for gear in gears)
            finding = _meaning(
                best, f"the torque of the motor {where}: {why} (gears {stated})", f"--torque-is motor{some}"
            )
            # No description is wrong by the gear ratio at each joint.
            return replace(finding, severity="refuse") if best.odds > CERTAIN and not some else finding
        about = ", ".join(two_digits(1 / factor) for factor in best.factors)
        option = f"gear_ratio in the robot's description, and --torque-is motor{some}"
        return _meaning(best, f"the torque of the motor {where}: {why} (gears of about {about})", option)
    if best.kind == "percent":
        return _meaning(best, f"torques in percent of the rated torque: {why}", "unit: '%' in a mapping")
    if some:
        return _meaning(best, f"another unit or a current on some joints: {why}", f"--torque-is current{some}")
    return _meaning(best, f"currents, or torques in another unit: {why}", "--torque-is current")


def _meaning(best: Hypothesis, what: str, option: str) -> Finding:
    return Finding(
        name="torque_meaning",
        severity="warning",
        text=f"the torque columns seem to hold {what}",
        action=f"state {option}; ignore this if the robot's description is wrong by these factors",
        value=float(np.exp(np.mean(np.log(best.factors)))),
    )


def _frictionless(evidence: Sequence[JointEvidence]) -> bool:
    return float(np.median([one.friction for one in evidence])) < FRICTIONLESS


def _computed(context: Context, evidence: Sequence[JointEvidence]) -> Finding | None:
    """Names torques without friction and noise: a controller has computed them."""
    unexplained = context.logged.unexplained
    worst = float(np.nanmax(unexplained))
    noisy = float(np.nanmedian(unexplained)) > COMPUTED or worst > AT_MOST
    if noisy or any(one.friction > FRICTIONLESS for one in evidence):
        return None
    return Finding(
        name="torque_meaning",
        severity="warning",
        text="the torques seem to be targets that a controller computed, not measurements: a rigid body without "
        f"friction leaves {percent(worst)} of them unexplained at most",
        action="log the measured torque or current; ignore this for a simulation without friction and noise",
        value=100 * worst,
        unit="%",
    )


def _nominal(context: Context, evidence: Sequence[JointEvidence]) -> list[Finding]:
    """Reports a description that is far off although the fit is good."""
    fitted = context.logged
    large = [t for t in evidence if 1 / max(t.size, 1e-12) > NOMINAL and fitted.unexplained[t.joint] < WELL]
    if not large:
        return []
    joints = joints_in_words(one.joint + 1 for one in large)
    ratio = max(1 / max(one.size, 1e-12) for one in large)
    return [
        Finding(
            name="nominal_error",
            severity="warning",
            text=f"the described torques of {joints} are up to {two_digits(ratio)} times the measured ones, although "
            "the fit is good",
            action="check the meaning and the unit of the torque columns, and the robot's description",
            value=100 * ratio,
            unit="%",
        )
    ]
