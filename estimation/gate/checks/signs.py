"""Torques that contradict physics: negative inertia, friction that drives, an arm that others move."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimation.gate.finding import Finding
from estimation.gate.quick_fits.joint_fit import OWN, JointFit, Rows
from estimation.gate.quick_fits.joint_physics import JointPhysics
from robots.robot import Robot

Array = NDArray[np.float64]

# Inertia and friction below minus so many standard errors have the wrong sign; friction alone must be beyond doubt, for
# a spring or a balancer that the model lacks can look like it.
SURE, CLEAR = 5.0, 15.0
# Power of friction, over that of the joint, below minus this drives; and how much worse (mean log variance) all torques
# are explained when a torque's sign is inverted, for it to be certainly right or wrong.
DRIVES, TURNED = 0.2, 0.3
# A torque below this share of the joint's limit is hardly one.
FAINT = 0.01
# Least inertia over moment of mass of a link [m], and the acceleration of gravity [m/s2].
COMPACT, GRAVITY = 0.01, 9.81


def check_signs(
    robot: Robot,
    rows: Rows,
    fits: Sequence[JointFit | None],
    physics: Sequence[JointPhysics | None],
    gains: Array,
    name: str,
) -> list[Finding]:
    """Finds torques with a negative inertia or a driving friction, without contrary evidence.

    Args:
        robot: with n joints.
        rows: the excerpts.
        fits: of each joint by itself.
        physics: what they say.
        gains: by how much the fit of all joints gets worse (mean log variance) with one torque turned (n,).
        name: prefix of the torques.
    """
    findings = []
    ratios = [(0.0, 0.0) if found is None else found.ratios for found in physics]
    agreed = [heavy > SURE or lossy > CLEAR for heavy, lossy in ratios]
    own = {}
    for joint, (fit, found) in enumerate(zip(fits, physics, strict=True), start=1):
        if fit is None or found is None:
            continue
        if _moved_by_others(fit, found, joint - 1, robot):
            findings.append(_external(found, name, joint))
            continue
        heavy, lossy = ratios[joint - 1]
        negative = heavy < -SURE and lossy < SURE / 2
        drives = lossy < -SURE and heavy < SURE / 2 and -found.loss > DRIVES * found.power
        # The other joints see the same links: a torque of wrong sign would fit them better when inverted.
        others = any(agreed[: joint - 1] + agreed[joint:])
        if lossy < -CLEAR and heavy > SURE and -found.loss > DRIVES * found.power:
            findings.append(_against_time(found, name, joint))
        elif (negative or drives) and not (others and gains[joint - 1] > TURNED):
            rms = float(np.sqrt(np.mean(rows.raw(joint - 1) ** 2)))
            own[joint] = negative or (lossy < -CLEAR and rms > FAINT * _finite(robot.limits.torque[joint - 1]))
    worst = int(np.argmin(gains)) + 1
    if not own and gains[worst - 1] < -TURNED and ratios[worst - 1][1] < SURE / 2:
        own[worst] = True
    for joint, sure in own.items():
        found = physics[joint - 1]
        assert found is not None
        findings.append(
            Finding(
                name="torque_sign",
                severity="refuse" if sure else "warning",
                text=f"implausible: with this torque the joint's inertia is {found.inertia:.3g} (standard error "
                f"{found.inertia_error:.2g}) and its friction power is {found.loss:.3g} W "
                f"({found.loss_error:.2g}): "
                + ("its sign is inverted" if sure else "it accelerates instead of braking"),
                action="set `sign: -1` for the torque, or the position, of this joint in a mapping (--mapping)",
                value=found.loss,
                unit="W",
                column=f"{name}{joint}",
                joint=joint,
            )
        )
    return findings


def _against_time(found: JointPhysics, name: str, joint: int) -> Finding:
    return Finding(
        name="negative_friction",
        severity="refuse",
        text=f"friction delivers {-found.loss:.3g} W (standard error {found.loss_error:.2g}) instead of consuming "
        f"power, "
        "but the inertia is positive: time runs backwards, or friction was overcompensated",
        action="check the order of the rows and the meaning of the torque column",
        value=found.loss,
        unit="W",
        column=f"{name}{joint}",
        joint=joint,
    )


def _finite(limit: float) -> float:
    return limit if np.isfinite(limit) else 0.0


def _moved_by_others(fit: JointFit, found: JointPhysics, joint: int, robot: Robot) -> bool:
    """Whether the torque holds the joint against gravity but does not accelerate it.

    A body's inertia about a joint over its moment of mass is r + k^2/r, with its centre at r and its radius of gyration
    k: at least 2 k, and no link of a robot is as compact as `COMPACT`.
    """
    if robot.chain.joints[joint].kind != "revolute":
        return False
    weight = fit.Y[:, :-OWN] @ fit.values[:-OWN]
    moment = float(weight.std()) / GRAVITY
    return abs(found.inertia) + SURE * found.inertia_error < COMPACT * moment


def _external(found: JointPhysics, name: str, joint: int) -> Finding:
    return Finding(
        name="moved_by_others",
        severity="refuse",
        text=f"this torque balances gravity but does not accelerate the joint: the estimated inertia is "
        f"{found.inertia:.3g} (standard error {found.inertia_error:.2g})",
        action="record a motion made by the drives, not one guided by hand",
        value=found.inertia,
        unit="kg m2",
        column=f"{name}{joint}",
        joint=joint,
    )
