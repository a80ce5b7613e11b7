"""Drives as files describe them: a gains YAML, the robot's own description, and actuators of an MJCF."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from pydantic import Field

from robots.common.config import Config, read_config
from robots.common.errors import InputError
from robots.drives.backlash import Backlash
from robots.drives.drive import Drive
from robots.drives.elastic_gear import ElasticGear
from robots.drives.laws import LAWS, ServoLaw
from robots.drives.mjcf_actuators import MjcfLaw, read_actuators
from robots.robot import Robot

Numbers = float | list[float] | dict[str, float]

GAINS = ("kp", "kd", "kr", "kv", "ki", "dead_band")
"""Keys of a gains file that are parameters of a law, if it has them."""
OF_GEAR = ("stiffness", "gear_damping", "backlash")
"""Those of an elastic gear. Joints for which none is stated have a rigid one."""
PARAMETERS = (*GAINS, "armature", "viscous", "coulomb", "torque_limit", "delay", "torque_constant", *OF_GEAR)
"""Keys of a gains file that are parameters of every joint."""


class MotorCurve(Config):
    """A torque that falls with the speed.

    Attributes:
        stall_torque: torque at rest [N m or N].
        no_load_speed: speed at which none is left [rad/s or m/s].
    """

    stall_torque: Numbers
    no_load_speed: Numbers


class GainsFile(Config):
    """What is known of the drives; each number for all joints, one per joint, or by parts of joint names.

    Attributes:
        law: ``pd`` or ``servo`` (kp, kd, dead_band), ``velocity`` (kv, ki) or ``cascade`` (kr, kv, ki).
        kp: position gain [N m/rad].
        kd: velocity gain [N m s/rad].
        kr: gain of a position loop that commands a velocity [1/s].
        kv: gain of a velocity loop [N m s/rad].
        ki: integral gain of a velocity loop [N m/rad].
        dead_band: error on either side that makes no torque [rad].
        step: resolution of the command [rad], such as 0.001534 for 4096 steps a turn.
        torque_limit: clamp of the torque [N m].
        motor_curve: the torque left at a speed.
        armature: rotor inertia at the joint [kg m2], to start from.
        viscous: viscous friction [N m s/rad], to start from.
        coulomb: Coulomb friction [N m], to start from.
        delay: of the command [s], to start from.
        torque_constant: torque at the joint per unit of a logged current [N m/A], such as N m per percent of a load.
        stiffness: of an elastic gear [N m/rad]; joints without it have a rigid one.
        gear_damping: damping of an elastic gear [N m s/rad].
        backlash: width of the gap of an elastic gear [rad].
        encoder: what the encoder shows, motor or link. Default: link for a servo, else motor.
    """

    law: Literal["pd", "servo", "velocity", "cascade"]
    kp: Numbers | None = None
    kd: Numbers | None = None
    kr: Numbers | None = None
    kv: Numbers | None = None
    ki: Numbers | None = None
    dead_band: Numbers | None = None
    step: float = Field(default=0.0, ge=0.0)
    torque_limit: Numbers | None = None
    motor_curve: MotorCurve | None = None
    armature: Numbers | None = None
    viscous: Numbers | None = None
    coulomb: Numbers | None = None
    delay: float | None = None
    torque_constant: Numbers | None = None
    stiffness: Numbers | None = None
    gear_damping: Numbers | None = None
    backlash: Numbers | None = None
    encoder: Literal["motor", "link"] | None = None


class DescribedDrives(NamedTuple):
    """Drives of all joints, and what is not known of them.

    Attributes:
        drives: of all joints, chain by chain.
        unknown: parameters of the law that nobody stated.
        source: where the law comes from, for people.
    """

    drives: tuple[Drive, ...]
    unknown: tuple[str, ...]
    source: str


def described_drives(robots: Sequence[Robot], gains: str | PathLike[str] | None = None) -> DescribedDrives:
    """Puts the drives of a robot together.

    Laws and gains come from the gains file, else from the actuators of an MJCF. Rotor inertia, friction and limits come
    from the gains file, else from the robot's description.

    Args:
        robots: the chains, see `load_branches`.
        gains: a gains YAML.

    Raises:
        InputError: no law, or a gains file with an unknown key, joint or value.
    """
    names = tuple(name for robot in robots for name in robot.joint_names)
    stated: list[dict[str, float]] = [{} for _ in names]
    at = 0
    for robot in robots:
        for j in range(robot.n):
            friction, limit = robot.friction[j], float(robot.limits.torque[j])
            constant = float(np.asarray(robot.torque_constant)[j])
            stated[at] = {
                "armature": float(robot.rotor_inertia[j]),
                "viscous": float(friction[1]),
                "coulomb": float(friction[0]),
            }
            stated[at] |= {"torque_limit": limit} if np.isfinite(limit) and limit > 0 else {}
            stated[at] |= {"torque_constant": constant} if np.isfinite(constant) and constant > 0 else {}
            at += 1
    if gains is None:
        return _from_mjcf(robots, names, stated)
    file = read_config(gains, GainsFile)
    law = ServoLaw(file.step) if file.law == "servo" else LAWS[file.law]()
    own = tuple(parameter.name for parameter in law.parameters())
    for key in PARAMETERS:
        value = getattr(file, key)
        if value is None:
            continue
        if key in GAINS and key not in own:
            raise InputError(f"{key} is no gain of the law {file.law}", file=gains, column=key, allowed=", ".join(own))
        for joint, number in enumerate(_spread(value, names, gains, key)):
            if number is not None:
                stated[joint][key] = number
    curve = file.motor_curve
    if curve is not None:
        for key in ("stall_torque", "no_load_speed"):
            for joint, number in enumerate(_spread(getattr(curve, key), names, gains, f"motor_curve.{key}")):
                if number is not None:
                    stated[joint][key] = number
    if file.step and file.law != "servo":
        raise InputError("step belongs to the law servo", file=gains, column="step", remedy="law: servo")
    needed = [key for key in own if key not in ("dead_band", "ki")]
    unknown = tuple(key for key in needed if not all(key in values for values in stated))
    encoder = file.encoder or ("link" if file.law == "servo" else "motor")
    try:
        drives = tuple(
            Drive.usual(law, values=values, curve=curve is not None, gear=_gear(values, name, gains), encoder=encoder)
            for values, name in zip(stated, names, strict=True)
        )
    except InputError as error:
        raise InputError(error.problem, file=gains, joint=error.joint, allowed=error.allowed) from error
    return DescribedDrives(drives, unknown, str(gains))


def _gear(values: Mapping[str, float], joint: str, file: str | PathLike[str]) -> ElasticGear | None:
    stated = [key for key in OF_GEAR if key in values]
    if stated and "stiffness" not in values:
        raise InputError(f"{stated[0]} without a stiffness", file=file, joint=joint, remedy="state `stiffness`, too")
    return None if not stated else Backlash() if "backlash" in values else ElasticGear()


def _spread(
    value: Numbers, names: Sequence[str], file: str | PathLike[str], key: str
) -> list[float] | list[float | None]:
    """One value per joint; None where a mapping names none."""
    if isinstance(value, Mapping):
        found: list[float | None] = [None] * len(names)
        for part, number in value.items():
            joints = [j for j, name in enumerate(names) if part.lower() in name.lower()]
            if not joints:
                raise InputError(
                    f"no joint's name contains {part!r}", file=file, column=key, allowed=f"parts of {', '.join(names)}"
                )
            for j in joints:
                found[j] = float(number)
        return found
    if isinstance(value, list):
        if len(value) != len(names):
            raise InputError(f"{len(value)} values", file=file, column=key, allowed=f"{len(names)}: {', '.join(names)}")
        return [float(number) for number in value]
    return [float(value)] * len(names)


def _from_mjcf(robots: Sequence[Robot], names: Sequence[str], stated: Sequence[dict[str, float]]) -> DescribedDrives:
    mjcf = next((robot.mjcf for robot in robots if robot.mjcf), "")
    laws: dict[str, MjcfLaw] = read_actuators(Path(mjcf)) if mjcf else {}
    missing = [name for name in names if name not in laws]
    if missing:
        what = "its actuators are motors" if mjcf else "a URDF does not state them"
        raise InputError(
            f"the control law of {', '.join(missing[:4])}{', ...' if len(missing) > 4 else ''} is not known: {what}",
            file=mjcf or None,
            remedy="state law and gains in a YAML (--gains), such as `law: pd`, `kp: 20`, `kd: 1.5`; gains that you "
            "leave out are identified",
        )
    drives = []
    for name, values in zip(names, stated, strict=True):
        law = laws[name]
        drives.append(Drive.usual(LAWS[law.law](), values={**values, **law.values}))
    return DescribedDrives(tuple(drives), (), mjcf)
