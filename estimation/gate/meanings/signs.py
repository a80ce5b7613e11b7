"""Torques that contradict physics: a negative inertia, friction that drives, an arm that is moved by others."""

from __future__ import annotations

import numpy as np

from estimation.gate.finding import Finding
from estimation.gate.meanings.comparison import Comparison
from estimation.gate.quick_fits.fitted import Fitted
from estimation.gate.quick_fits.joint_columns import OWN
from estimation.gate.quick_fits.joint_fit import JointFit
from estimation.gate.quick_fits.joint_physics import JointPhysics, described_ratio
from estimation.gate.quick_fits.reading import Reading, scaled
from estimation.gate.quick_fits.whole_fit import POORLY_EXPLAINED
from robots.robot import Robot

# Standard errors below zero from which inertia or friction is negative. The second one is for friction alone: a spring
# or a balancer that the model lacks can look like negative friction.
NEGATIVE, CLEARLY_NEGATIVE = 5.0, 15.0
# Friction drives if its power is below minus this share of the joint's power.
DRIVING_SHARE = 0.2
# Increase of the error of all joints (mean log) by the opposite sign of a torque, from which the sign is right.
SIGN_COST = 0.15
# Correlation with the described torque from which a torque has the described sign.
SAME_SIGN = 0.9
# RMS torque over the joint's limit, below which a torque is too small for a refusal.
SMALL_TORQUE = 0.01
# Least ratio of inertia to first moment of mass of a link [m], and the acceleration of gravity [m/s2].
COMPACT, GRAVITY = 0.01, 9.81


def sign_findings(fitted: Fitted, prefix: str, *, likely: bool) -> tuple[list[Finding], list[Finding]]:
    """Finds torques with a negative inertia or a driving friction, unless the other joints contradict.

    Args:
        fitted: the log as it is read.
        prefix: of its torques or currents.
        likely: whether the columns hold torques: those of another meaning may have any sign.

    Returns:
        Torques with the opposite sign, without an action; and what else contradicts physics.
    """
    robot = fitted.robot
    significances = [(0.0, 0.0) if found is None else found.significances for found in fitted.physics]
    backwards = 2 * sum(friction < -CLEARLY_NEGATIVE for _, friction in significances) > len(significances)
    plausible = [inertia > NEGATIVE or friction > CLEARLY_NEGATIVE for inertia, friction in significances]
    opposite, others = [], []
    for joint, (fit, found) in enumerate(zip(fitted.fits, fitted.physics, strict=True)):
        if fit is None or found is None:
            continue
        inertia, friction = significances[joint]
        drives = -found.loss > DRIVING_SHARE * found.power
        negative = inertia < -NEGATIVE and friction < NEGATIVE / 2
        # The other joints move the same links: the opposite sign would fit them better if this one were wrong.
        contradicted = any(plausible[:joint] + plausible[joint + 1 :]) and _sign_cost(fitted, joint) > SIGN_COST
        if _is_moved_by_others(fit, found, joint, robot):
            others.append(_moved_by_others(found, prefix, joint))
        elif friction < -CLEARLY_NEGATIVE and inertia > NEGATIVE and drives:
            # Time that runs backwards makes the friction of all joints drive.
            certain = backwards and fitted.unexplained[joint] < POORLY_EXPLAINED
            others.append(_negative_friction(found, prefix, joint, certain))
        elif (negative or (friction < -NEGATIVE and inertia < NEGATIVE / 2 and drives)) and not contradicted:
            described = described_ratio(robot, fit)
            if described is not None and described[0] > 0 and described[1] > SAME_SIGN:
                continue
            large = _rms_torque(fitted, joint) > SMALL_TORQUE * _finite(robot.limits.torque[joint])
            clear = negative or (friction < -CLEARLY_NEGATIVE and large)
            certain = likely and clear and fitted.unexplained[joint] < POORLY_EXPLAINED
            opposite.append(_opposite(found, prefix, joint, certain))
    return opposite, others


def _sign_cost(fitted: Fitted, joint: int) -> float:
    """Gives the increase of the error (mean log) by the opposite sign of a joint's torque."""
    fits = Comparison(fitted)
    return fits.cost(scaled(fitted.robot.n, joint, tau=-1.0)) - fits.cost(Reading())


def _rms_torque(fitted: Fitted, joint: int) -> float:
    return float(np.sqrt(np.mean(fitted.rows.raw(joint) ** 2)))


def _finite(limit: float) -> float:
    return limit if np.isfinite(limit) else 0.0


def _is_moved_by_others(fit: JointFit, found: JointPhysics, joint: int, robot: Robot) -> bool:
    """Whether the torque balances gravity but does not accelerate the joint.

    The inertia of a body about a joint over its first moment of mass is r + k^2/r, with the centre of mass at r and the
    radius of gyration k. It is at least 2 k, and no link of a robot is as compact as `COMPACT`.
    """
    if robot.chain.joints[joint].kind != "revolute":
        return False
    weight = fit.Y[:, :-OWN] @ fit.values[:-OWN]
    moment = float(weight.std()) / GRAVITY
    # An inverted torque has an inertia that is as large as any link's, of the wrong sign.
    return abs(found.inertia + NEGATIVE * found.inertia_error) < COMPACT * moment


def _moved_by_others(found: JointPhysics, prefix: str, joint: int) -> Finding:
    return Finding(
        name="moved_by_others",
        severity="refuse",
        text=f"this torque balances gravity but does not accelerate the joint: the estimated inertia is "
        f"{found.inertia:.3g} (standard error {found.inertia_error:.2g})",
        action="record a motion made by the drives, not one guided by hand",
        value=found.inertia,
        unit="kg m2",
        column=f"{prefix}{joint + 1}",
        joint=joint + 1,
    )


def _negative_friction(found: JointPhysics, prefix: str, joint: int, certain: bool) -> Finding:
    return Finding(
        name="negative_friction",
        severity="refuse" if certain else "warning",
        text=f"friction delivers {-found.loss:.3g} W (standard error {found.loss_error:.2g}) instead of consuming "
        "power, but the inertia is positive: time runs backwards, or friction was overcompensated",
        action="check the order of the rows and the meaning of the torque column",
        value=found.loss,
        unit="W",
        column=f"{prefix}{joint + 1}",
        joint=joint + 1,
    )


def _opposite(found: JointPhysics, prefix: str, joint: int, certain: bool) -> Finding:
    return Finding(
        name="torque_sign",
        severity="refuse" if certain else "warning",
        text=f"implausible: with this torque the joint's inertia is {found.inertia:.3g} (standard error "
        f"{found.inertia_error:.2g}) and its friction power is {found.loss:.3g} W ({found.loss_error:.2g}): "
        + ("its sign is inverted" if certain else "it accelerates instead of braking"),
        action="",
        value=found.loss,
        unit="W",
        column=f"{prefix}{joint + 1}",
        joint=joint + 1,
    )
