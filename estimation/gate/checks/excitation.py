"""Joints whose torque does not follow from the motion, or does not determine the inertia."""

from __future__ import annotations

from estimation.gate.context import Context
from estimation.gate.finding import Finding
from estimation.gate.quick_fits.whole_fit import LIKE_A_CONSTANT, POORLY_EXPLAINED
from robots.common.plain import joints_in_words, two_digits
from robots.robot import Robot

# A joint is badly excited if its held-out error over the torque's standard deviation is above the first, and neither
# inertia nor friction differs from zero by so many standard errors.
BADLY_EXCITED, SIGNIFICANT = 0.7, 10.0
# What to do if no joint is explained better than by a constant.
NOTHING_FITS = "check units, signs and order of the joints, and that the log belongs to this robot"


def excitation(context: Context) -> list[Finding]:
    """Finds joints whose torque does not follow from the motion."""
    fitted, prefix = context.fitted, context.cleaned.columns.prefix
    others = bool((fitted.unexplained < LIKE_A_CONSTANT).any())
    findings = []
    for joint, (found, error) in enumerate(zip(fitted.physics, fitted.unexplained, strict=True)):
        if found is None or error < POORLY_EXPLAINED:
            continue
        # Inertia or friction that differ from zero are excited: the torque holds something else, too.
        weak = not error <= BADLY_EXCITED and found.information < SIGNIFICANT
        findings.append(
            _bad(context.robot, float(error), found.information, prefix, joint, others)
            if weak
            else _poor(context.robot, float(error), prefix, joint, others)
        )
    return findings


def _bad(robot: Robot, error: float, information: float, prefix: str, joint: int, others: bool) -> Finding:
    return Finding(
        name="badly_excited",
        severity="warning" if others else "refuse",
        text=f"{robot.joint_names[joint]} is badly excited: on held-out data the error is {100 * error:.3g} % of the "
        "torque's standard deviation, and its inertia and friction differ from zero by at most "
        f"{two_digits(information)} standard errors",
        action="its parameters are not determined; record faster motions of this joint with larger torques"
        if others
        else NOTHING_FITS,
        value=100 * error,
        unit="%",
        column=f"{prefix}{joint + 1}",
        joint=joint + 1,
    )


def _poor(robot: Robot, error: float, prefix: str, joint: int, others: bool) -> Finding:
    return Finding(
        name="poorly_explained",
        severity="warning" if others else "refuse",
        text=f"{robot.joint_names[joint]}: rigid body and friction leave {100 * error:.3g} % of the torque's standard "
        "deviation unexplained on held-out data",
        action="possible causes: noise, an effect missing in the model, or a wrong order, sign or zero of a joint; run "
        "oed diagnose"
        if others
        else NOTHING_FITS,
        value=100 * error,
        unit="%",
        column=f"{prefix}{joint + 1}",
        joint=joint + 1,
    )


# Decrease of the held-out error (log) that velocities and accelerations must bring. With some 300 independent rows this
# is three standard errors of their torque.
LEAST = 0.015
# Held-out error over the torque's standard deviation up to which a joint is judged: others are reported as they are.
EXPLAINED = 0.3


def undetermined(context: Context) -> list[Finding]:
    """Names the joints whose torques are explained as well without velocities and accelerations.

    It is said if most joints are concerned: a light joint by itself may hide its inertia behind friction. The log may
    fit well: slow motions show gravity and friction. A model of them fails at usual speeds, because the
    inertias are below some three standard errors.
    """
    bad = {finding.joint for finding in context.found(("badly_excited",))}
    gain = context.fitted.dynamic_gain
    well = context.fitted.unexplained < EXPLAINED
    weak = [j for j in range(context.robot.n) if j + 1 not in bad and well[j] and gain[j] < LEAST]
    if 2 * len(weak) <= context.robot.n:
        return []
    return [
        Finding(
            name="undetermined",
            severity="warning",
            text=f"the log does not determine the inertia of {_joints(context.robot, weak)}: torques are explained "
            "as well without accelerations",
            action="the inertias are then below some 3 standard errors, and predictions of faster motions are "
            "wrong; add a log of faster motions",
            value=100 * float(gain[weak].min()),
            unit="%",
            joint=weak[0] + 1 if len(weak) == 1 else None,
        )
    ]


def _joints(robot: Robot, joints: list[int]) -> str:
    if len(joints) == robot.n and robot.n > 1:
        return "all joints"
    return joints_in_words(joint + 1 for joint in joints)
