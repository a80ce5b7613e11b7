"""Torque that does not follow from the motion: joints that are badly excited, or explained badly."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimation.gate.finding import Finding
from estimation.gate.quick_fits.joint_physics import JointPhysics
from robots.robot import Robot

Array = NDArray[np.float64]

# A joint whose held-out torque is predicted hardly better than by a constant is not identified.
HOPELESS = 0.9
# A joint is badly excited if less than half of its torque variance follows from the motion and none of its parameters
# differs from zero by this many standard errors.
WEAK, FAINTLY = 0.7, 10.0
# An error above this share of the torque's standard deviation is worth a warning by itself.
POOR = 0.3


def check_excitation(
    robot: Robot, physics: Sequence[JointPhysics | None], unexplained: Array, name: str
) -> list[Finding]:
    """Finds joints whose torque does not follow from the motion.

    Args:
        robot: with n joints.
        physics: what the fits of each joint say.
        unexplained: error on left-out stretches over the torque's standard deviation (n,).
        name: prefix of the torques.
    """
    explained = unexplained < HOPELESS
    findings = []
    for joint, (found, error) in enumerate(zip(physics, unexplained, strict=True), start=1):
        if found is not None and POOR <= error < HOPELESS and (error <= WEAK or found.information >= FAINTLY):
            findings.append(_poor(robot, float(error), name, joint))
        if found is None or (error < HOPELESS and not (error > WEAK and found.information < FAINTLY)):
            continue
        title = robot.joint_names[joint - 1]
        findings.append(
            Finding(
                name="badly_excited",
                severity="warning" if explained.any() else "refuse",
                text=(
                    f"{title} is badly excited: on held-out data the error is {100 * error:.3g} % of the torque's "
                    f"standard deviation, and its inertia and friction differ from zero by at most "
                    f"{found.information:.2g} standard errors"
                ),
                action="its parameters are not determined; record faster motions of this joint with larger torques"
                if explained.any()
                else "check units, signs and order of the joints, and that the log belongs to this robot",
                value=100 * float(error),
                unit="%",
                column=f"{name}{joint}",
                joint=joint,
            )
        )
    return findings


def _poor(robot: Robot, error: float, name: str, joint: int) -> Finding:
    return Finding(
        name="poorly_explained",
        severity="warning",
        text=(
            f"{robot.joint_names[joint - 1]}: rigid body and friction leave {100 * error:.3g} % of the torque's "
            f"standard deviation unexplained on held-out data"
        ),
        action=(
            "possible causes: noise, an effect missing in the model, or a wrong order, sign or zero of a joint; run "
            "oed diagnose"
        ),
        value=100 * error,
        unit="%",
        column=f"{name}{joint}",
        joint=joint,
    )
