"""What the torque columns hold, by the torques of the robot's description."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from estimation.gate.finding import Finding, Severity
from estimation.gate.meanings.described import JointEvidence
from estimation.gate.meanings.findings import WITHOUT_GRAVITY, remedy
from estimation.gate.meanings.hypotheses import GEARED, UNITS, Hypothesis, hypotheses
from estimation.gate.quick_fits.fitted import Fitted
from estimation.gate.quick_fits.reading import Reading
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
# Factors on the torque of single joints that an error of the torque constant explains as well.
CONSTANT = (1 / 3, 3.0)
# The meanings in a few words.
OTHERWISE = {
    "current": "currents",
    "external": "external torques",
    "motor": "the torque of the motor on some joints",
    "percent": "torques in percent",
    "unit": "torques in another unit",
    "weightless": "torques without gravity",
}
# Nominal error over the torque's RMS, from which it is reported by itself, if this share is unexplained at most.
NOMINAL, WELL = 3.0, 0.3


def likely_meaning(robot: Robot, evidence: Sequence[JointEvidence]) -> Hypothesis | None:
    """Gives the most likely meaning of the torques, if it is much more likely than joint torques of either sign.

    Each meaning predicts the torques from the robot's description, within the description's errors.
    """
    (best, *_) = hypotheses(robot, evidence) if evidence else [None]
    return None if best is None or best.odds <= LIKELY or best.kind == "sign" else best


def scale_of(robot: Robot, best: Hypothesis | None) -> Reading:
    """Gives the reading of torques in a known unit; as logged for any other meaning."""
    if best is None or best.unit is None:
        return Reading()
    scale = np.ones(robot.n)
    scale[list(best.joints)] = 1.0 / best.unit
    return Reading(tau_factor=scale)


def torque_findings(
    fitted: Fitted, evidence: Sequence[JointEvidence], best: Hypothesis | None, reading: Reading
) -> list[Finding]:
    """Reports the most likely meaning of torques beside joint torques, or large nominal errors without one.

    Args:
        fitted: the log as it is read.
        evidence: of its torques, see `joint_evidence`.
        best: see `likely_meaning`.
        reading: of the columns, with the scale of the torques.
    """
    if not evidence:
        return []
    if (computed := _computed(fitted, evidence)) is not None:
        return [computed]
    if best is None:
        return _nominal(fitted, evidence)
    others = [one for one in hypotheses(fitted.robot, evidence) if one.kind != best.kind]
    finding = _finding(fitted.robot, best, reading)
    close = {OTHERWISE[other.kind] for other in others if other.odds > best.odds - CLOSE and other.kind in OTHERWISE}
    scaled = best.kind in ("current", "motor", "unit")
    if scaled and max(best.factors) < SUBTRACTED and _frictionless(evidence):
        close.add(OTHERWISE["external"])
    if scaled and len(best.joints) < fitted.robot.n and all(CONSTANT[0] < f < CONSTANT[1] for f in best.factors):
        close.add("a wrong torque constant (torque_constant_error), which oed diagnose names")
    close -= {OTHERWISE[best.kind]}
    also = f" (about as likely: {', '.join(sorted(close))})" if close else ""
    return [replace(finding, text=finding.text + also)]


def _finding(robot: Robot, best: Hypothesis, reading: Reading) -> Finding:
    severe = best.odds > CERTAIN
    if best.kind == "weightless":
        better = "the described torques without gravity fit them better than those with it"
        state = remedy(replace(reading, compensated=True), "tau")
        return _meaning(f"{WITHOUT_GRAVITY}: {better}", state, best.odds, certain=severe)
    if best.kind == "external":
        text = "the column seems to hold external torques, such as tau_ext: "
        text += "the described torques are not in it, at any scale"
        action = "log the torque or current of the drives; the controller has subtracted its own model from this column"
        return _meaning(text, action, best.odds, certain=severe)
    some = "" if len(best.joints) == robot.n else f":{','.join(str(joint + 1) for joint in best.joints)}"
    factors = [two_digits(factor) for factor in best.factors]
    # Another unit has one factor for all joints.
    listed = factors[0] if len(set(factors)) == 1 else ", ".join(factors)
    why = f"they are about {listed} times the described torques of {joints_in_words(j + 1 for j in best.joints)}"
    where = "on some joints" if some else "on all joints"
    state, certain = f"--torque-is {best.kind}{some}", False
    if best.kind == "motor":
        gears = np.abs(np.asarray(robot.gear_ratio, dtype=float))[list(best.joints)]
        what = f"the torque of the motor {where}: {why}"
        if (gears > GEARED).all():
            what += f" (gears {', '.join(f'{gear:.4g}' for gear in gears)})"
            # No description is wrong by the gear ratio at each joint.
            certain = severe and not some
        else:
            what += f" (gears of about {', '.join(two_digits(1 / factor) for factor in best.factors)})"
            state = f"gear_ratio in the robot's description, and {state}"
    elif best.kind == "percent":
        what, state = f"torques in percent of the rated torque: {why}", "unit: '%' in a mapping"
    elif best.unit:
        what = f"torques in {UNITS[best.unit]} {where}: {why}"
        state = remedy(reading, "tau").removeprefix("state ")
    elif some:
        what = f"another unit or a current on some joints: {why}"
    else:
        what, state = f"currents, or torques in another unit: {why}", "--torque-is current"
    if not best.unit and (lines := reading.mapping("tau")):
        state += f", beside {' and '.join(f'`{line}`' for line in lines)} in a mapping (--mapping)"
    action = f"state {state}; ignore this if the robot's description is wrong by these factors"
    size = float(np.exp(np.mean(np.log(best.factors))))
    return _meaning(f"the torque columns seem to hold {what}", action, size, certain=certain)


def _meaning(text: str, action: str, value: float, *, certain: bool, unit: str = "") -> Finding:
    severity: Severity = "refuse" if certain else "warning"
    return Finding(name="torque_meaning", severity=severity, text=text, action=action, value=value, unit=unit)


def _frictionless(evidence: Sequence[JointEvidence]) -> bool:
    return float(np.median([one.friction for one in evidence])) < FRICTIONLESS


def _computed(fitted: Fitted, evidence: Sequence[JointEvidence]) -> Finding | None:
    """Names torques without friction and noise: a controller has computed them."""
    worst = float(np.nanmax(fitted.unexplained))
    noisy = float(np.nanmedian(fitted.unexplained)) > COMPUTED or worst > AT_MOST
    if noisy or any(one.friction > FRICTIONLESS for one in evidence):
        return None
    text = (
        "the torques seem to be targets that a controller computed, not measurements: a rigid body without friction "
        f"leaves {percent(worst)} of them unexplained at most"
    )
    action = "log the measured torque or current; ignore this for a simulation without friction and noise"
    return _meaning(text, action, 100 * worst, certain=False, unit="%")


def _nominal(fitted: Fitted, evidence: Sequence[JointEvidence]) -> list[Finding]:
    """Reports a description that is far off although the fit is good."""
    large = [t for t in evidence if 1 / max(t.size, 1e-12) > NOMINAL and fitted.unexplained[t.joint] < WELL]
    if not large:
        return []
    joints = joints_in_words(one.joint + 1 for one in large)
    ratio = max(1 / max(one.size, 1e-12) for one in large)
    text = (
        f"the described torques of {joints} are up to {two_digits(ratio)} times the measured ones, although the fit is "
        "good"
    )
    action = "check the meaning and the unit of the torque columns, and the robot's description"
    value = 100 * ratio
    return [Finding(name="nominal_error", severity="warning", text=text, action=action, value=value, unit="%")]
