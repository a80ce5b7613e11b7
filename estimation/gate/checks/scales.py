"""Torques by a wrong factor: of the motor, in percent, or far from what the description expects."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from estimation.gate.finding import Finding
from estimation.gate.quick_fits.joint_fit import OWN, JointFit, Rows
from estimation.gate.quick_fits.rigid_body import rigid_body
from estimation.gate.quick_fits.whole_fit import Moments, fit_all
from robots.robot import Robot

Array = NDArray[np.float64]

# How much better (mean log error) the joints must agree in another unit of torque; twice this is beyond doubt.
DISAGREE = 0.1
# A torque that follows the description's in shape (this correlation) but not in size (beyond this factor).
ALIKE, FACTOR = 0.9, 20.0


def check_scales(robot: Robot, moments: Moments, spread: Array) -> list[Finding]:
    """Finds torques whose joints do not agree on the links they share, but would in another unit.

    Args:
        robot: with n joints.
        moments: of the torques as they were logged.
        spread: their standard deviations (n,).
    """
    limits, gears = np.asarray(robot.limits.torque), np.abs(np.asarray(robot.gear_ratio))
    candidates = {"in percent of the rated torque": limits / 100.0, "the motor's, not the joint's": gears}
    now = np.clip(fit_all(moments, spread).unexplained, 1e-9, 1.0)
    findings = []
    for words, factor in candidates.items():
        if not np.isfinite(factor).all() or np.ptp(factor) <= 0.2 * factor.max() or (factor <= 0).any():
            continue
        then = np.clip(fit_all(moments.scaled(factor), spread * factor).unexplained, 1e-9, 1.0)
        better = float(np.nanmean(np.log(now)) - np.nanmean(np.log(then)))
        if better > DISAGREE:
            findings.append(
                Finding(
                    name="unit_of_torque",
                    severity="refuse" if better > 2 * DISAGREE else "warning",
                    text="the torques of the joints do not fit one robot: errors would be "
                    f"{100 * (1 - np.exp(-better)):.3g} % smaller if the torques were {words}",
                    action="set the unit of tau in a mapping (--mapping)",
                    value=better,
                )
            )
    return findings


def check_size(
    robot: Robot, rows: Rows, fits: Sequence[JointFit | None], name: str, known: Collection[int]
) -> list[Finding]:
    """Finds torques that have the shape of the description's but another size: the motor's, a percentage, a sign.

    Args:
        robot: with n joints; without inertias nothing is compared.
        rows: the excerpts.
        fits: of each joint by itself.
        name: prefix of the torques.
        known: joints of which something is wrong already.
    """
    nominal = np.asarray(robot.inertia, dtype=float).ravel()
    if not np.isfinite(nominal).all() or not np.any(nominal):
        return []
    described = rigid_body(robot).nominal
    findings = []
    for joint, fit in enumerate(fits, start=1):
        if fit is None or joint in known:
            continue
        tau = fit.Y @ fit.values + fit.residual
        # Friction and offset are no matter of the description.
        own = fit.Y[:, -OWN + 1 :]
        expected = fit.Y[:, :-OWN] @ (fit.scale[:-OWN] * described[fit.used])
        both = np.column_stack([expected, tau])
        both = both - own @ np.linalg.lstsq(own, both, rcond=None)[0]
        model, rest = both.T
        if model @ model < 1e-4 * (expected @ expected) or not rest @ rest > 0:
            continue
        slope = float(model @ rest / (model @ model))
        likeness = float(model @ rest / np.sqrt((model @ model) * (rest @ rest)))
        if abs(likeness) < ALIKE or 1 / FACTOR < slope < FACTOR:
            continue
        gear = float(abs(robot.gear_ratio[joint - 1]))
        guess = (
            "its sign is inverted"
            if slope < 0
            else f"it seems to be the motor torque (gear ratio {gear:.4g})"
            if gear > 2 and 0.5 < slope * gear < 2
            else "check its unit (percent of the rated torque, N mm, motor side)"
        )
        findings.append(
            Finding(
                name="torque_sign" if slope < 0 else "unit_of_torque",
                severity="warning",
                text=(
                    f"is {slope:.3g} times the torque computed from the robot's description (correlation "
                    f"{likeness:.2f}): {guess}"
                ),
                action=(
                    "set unit, gear ratio or sign in a mapping (--mapping); ignore this if the robot's description is "
                    "inaccurate"
                ),
                value=slope,
                column=f"{name}{joint}",
                joint=joint,
            )
        )
    return findings
