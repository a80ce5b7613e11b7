"""What the torque column means, by the torques of the robot's description."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from estimation.gate.candidates.described_torques import (
    DescribedTorque,
    Multiple,
    described_torques,
    pooled,
    tells_size,
)
from estimation.gate.check import Check
from estimation.gate.checks.likely_causes import without_gravity
from estimation.gate.context import Context, Stage
from estimation.gate.finding import Finding
from robots.robot import Robot

# Relative standard deviation by which the torque of one joint may differ from its description: links that are 20 % off.
OWN = 0.25
# A factor is known if its standard error is below this, or below this share of it.
KNOWN, SHARE = 0.2, 0.2
# Gravity is missing if its factor is below the first, that of inertia above the second, and both differ by the third.
LIGHT, HEAVY, APART = 0.45, 0.55, 0.45
# Torques are external if both factors are below this.
LITTLE = 0.3
# They are no currents if a joint lacks the described shape (correlation), or if no joint shows friction (share of the
# torque), which drives always have. Joints count whose factor is known to this share of it, or of TENTH or half
# of the largest if it is less.
PRECISE, TENTH, SHAPED, NO_FRICTION = 0.04, 0.1, 0.98, 0.105
# Factor by which the mean of the joints (geometric), or a single joint, differs from the description, to be in another
# unit. These are some 3.3 and 3.7 standard deviations of descriptions that are 20 % off.
SCALE, SINGLE = 1.8, 2.5
# Gear ratios that a motor's torque would show where the description states none.
GEARS = (15.0, 400.0)
# Unexplained share of the torques of half of the joints and of all, and share of friction, up to which torques are
# computed and not measured.
COMPUTED, AT_MOST, FRICTIONLESS = 0.005, 0.05, 0.12
# Findings that explain the torques already.
EXPLAINED = (
    "gravity_direction",
    "motor_side_position",
    "static_poses",
    "swapped_columns",
    "torque_meaning",
    "unit_of_position",
    "unit_of_time",
    "wrapped_angle",
)
# Nominal error over the torque's RMS, from which it is reported by itself, if this share is unexplained at most.
NOMINAL, WELL = 3.0, 0.3


class TorqueMeanings(Check):
    """Compares torques with the candidates that a description gives: gravity alone, inertia alone, all, or nothing.

    Measured torques are regressed on the described torques of inertia and of gravity, with free friction and offset.
    Factors near one mean a torque. Other factors mean something else.
    """

    name: ClassVar[str] = "torque_meanings"
    stage: ClassVar[Stage] = Stage.FITTED
    order: ClassVar[int] = 65

    def run(self, context: Context) -> list[Finding]:
        """Reports one meaning at most, or large nominal errors without one."""
        described = np.asarray(context.robot.inertia, dtype=float).ravel()
        explained = any(finding.severity != "info" for finding in context.found(EXPLAINED))
        if not np.isfinite(described).all() or not described.any() or explained:
            return []
        if context.cleaned.columns.prefix != "tau":
            return []
        torques = described_torques(context.fitted)
        known = [torque for torque in torques if _is_known(torque.whole)]
        inertial = [torque.inertial for torque in torques if _is_known(torque.inertial)]
        gravity = [torque.gravity for torque in torques if _is_known(torque.gravity)]
        if not known:
            return []
        a, b = pooled(inertial, OWN), pooled(gravity, OWN)
        if gravity and inertial and b.value < LIGHT and HEAVY < a.value < 1 / HEAVY and a.value - b.value > APART:
            why = (
                f"they show {_interval(b)} times the described gravity, but {_interval(a)} times the described inertia"
            )
            return [without_gravity(why, b.value, "", a.value - b.value > 2 * max(a.error, b.error))]
        found = _external(known, a, b) or _computed(context, known) or _scaled(context.robot, known)
        return [found] if found else _nominal(context, torques)


def _is_known(factor: Multiple) -> bool:
    return factor.error < max(KNOWN * SCALE * 0.5, SHARE * abs(factor.value))


def _interval(factor: Multiple) -> str:
    low, high = factor.value - 2 * factor.error, factor.value + 2 * factor.error
    return f"{factor.value:.2g} ({low:.2g} to {high:.2g})"


def _external(torques: list[DescribedTorque], a: Multiple, b: Multiple) -> Finding | None:
    """Names torques that contain little of the described ones, and not in proportion."""
    if not all(abs(factor.value) < LITTLE for factor in (a, b) if np.isfinite(factor.error)):
        return None
    least = min(TENTH, 0.5 * max(abs(torque.whole.value) for torque in torques))
    precise = [t for t in torques if t.whole.error < PRECISE * max(abs(t.whole.value), least)]
    shaped = all(torque.whole.value > 0 and not torque.shape < SHAPED for torque in precise)
    if not precise or (shaped and not all(torque.friction < NO_FRICTION for torque in precise)):
        return None
    return Finding(
        name="torque_meaning",
        severity="refuse",
        text=f"the column seems to hold external torques, such as tau_ext: inertia is {_interval(a)} and gravity "
        f"{_interval(b)} times the described one, not in proportion",
        action="log the torque or current of the drives; the controller has subtracted its own model from this column",
        value=b.value if np.isfinite(b.error) else a.value,
    )


def _scaled(robot: Robot, torques: list[DescribedTorque]) -> Finding | None:
    """Names currents, motor torques and other units, by the factors of the joints."""
    torques = [torque for torque in torques if tells_size(torque)]
    factors = np.array([torque.whole.value for torque in torques])
    joints = np.array([torque.joint for torque in torques])
    if not len(factors):
        return None
    logs = np.log(factors)
    off = np.abs(logs) > np.log(SINGLE)
    single = 2 * off.sum() <= len(logs) and len(logs) > 1 and abs(float(np.median(logs[~off]))) < np.log(SCALE)
    if single and off.any():
        return _single_joints(robot, joints[off], factors[off])
    if abs(float(logs.mean())) < np.log(SCALE) or abs(float(np.median(logs))) < np.log(SCALE):
        return None
    gears = np.abs(np.asarray(robot.gear_ratio, dtype=float))[joints]
    limits = np.asarray(robot.limits.torque, dtype=float)[joints]
    constants = np.abs(np.asarray(robot.torque_constant, dtype=float))[joints]
    listed = ", ".join(f"{factor:.2g}" for factor in factors)
    why = f"they are {listed} times the described torques of joints {', '.join(str(joint + 1) for joint in joints)}"
    if (gears > 2).all() and _near(factors * gears):
        return _meaning(f"motor torques: {why}, which is one over the gear ratios", "--torque-is motor", factors)
    if np.isfinite(limits).all() and _near(factors * limits / 100):
        return _meaning(f"torques in the unit percent of the rated torque: {why}", "unit: '%' in a mapping", factors)
    sure = np.isfinite(constants).all() and _near(factors * constants)
    more = "which is one over the torque constants" if sure else "with their shape; or torques in another unit"
    return _meaning(f"currents: {why}, {more}", "--torque-is current", factors)


def _single_joints(robot: Robot, joints: np.ndarray, factors: np.ndarray) -> Finding:
    gears = np.abs(np.asarray(robot.gear_ratio, dtype=float))[joints]
    named = ",".join(str(joint + 1) for joint in joints)
    listed = ", ".join(f"{factor:.2g}" for factor in factors)
    why = f"joint {named} has {listed} times its described torque, and the others agree with theirs"
    stated = gears > 2
    if np.where(stated, np.abs(np.log(factors * gears)) < np.log(SINGLE), False).all():
        return _meaning(
            f"the torque of the motor on some joints: {why} (gear {gears[0]:.4g})",
            f"--torque-is motor:{named}",
            factors,
        )
    if not stated.any() and all(GEARS[0] < 1 / factor < GEARS[1] for factor in factors):
        return _meaning(
            f"the torque of the motor on some joints: {why} (a gear of about {1 / factors[0]:.3g})",
            f"gear_ratio in the robot's description, and --torque-is motor:{named}",
            factors,
        )
    return _meaning(f"another unit or a current on some joints: {why}", f"--torque-is current:{named}", factors)


def _near(ratios: np.ndarray) -> bool:
    return bool((np.abs(np.log(ratios)) < np.log(SINGLE)).all() and abs(float(np.log(ratios).mean())) < np.log(SCALE))


def _meaning(what: str, option: str, factors: np.ndarray) -> Finding:
    return Finding(
        name="torque_meaning",
        severity="warning",
        text=f"the torque columns seem to hold {what}",
        action=f"state {option}; ignore this if the robot's description is wrong by these factors",
        value=float(np.exp(np.mean(np.log(factors)))),
    )


def _computed(context: Context, torques: list[DescribedTorque]) -> Finding | None:
    """Names torques without friction and noise: a controller has computed them."""
    unexplained = context.fitted.unexplained
    worst = float(np.nanmax(unexplained))
    noisy = float(np.nanmedian(unexplained)) > COMPUTED or worst > AT_MOST
    if noisy or any(torque.friction > FRICTIONLESS for torque in torques):
        return None
    return Finding(
        name="torque_meaning",
        severity="warning",
        text="the torques seem to be targets that a controller computed, not measurements: a rigid body without "
        f"friction leaves {100 * worst:.2g} % of them unexplained at most",
        action="log the measured torque or current; ignore this for a simulation without friction and noise",
        value=100 * worst,
        unit="%",
    )


def _nominal(context: Context, torques: list[DescribedTorque]) -> list[Finding]:
    """Reports a description that is far off although the fit is good."""
    fitted = context.fitted
    large = [t for t in torques if 1 / max(t.size, 1e-12) > NOMINAL and fitted.unexplained[t.joint] < WELL]
    if not large:
        return []
    joints = ", ".join(str(torque.joint + 1) for torque in large)
    ratio = max(1 / max(torque.size, 1e-12) for torque in large)
    return [
        Finding(
            name="nominal_error",
            severity="warning",
            text=f"the described torques of joints {joints} are up to {ratio:.2g} times the measured ones, although "
            "the fit is good",
            action="check the meaning and the unit of the torque columns, and the robot's description",
            value=100 * ratio,
            unit="%",
        )
    ]
