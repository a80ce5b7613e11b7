"""The units of a joint's quantities, and the names by which people know the joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robots.common.errors import InputError

KINDS = ("revolute", "prismatic")


@dataclass(frozen=True, kw_only=True)
class JointUnits:
    """Units in which the quantities of one joint are shown.

    Args:
        factor: what turns SI values of position, velocity and acceleration into the unit shown.
        position: unit of the position.
        torque: unit of the torque or force.
    """

    factor: float
    position: str
    torque: str

    @property
    def effort(self) -> str:
        """What a drive exerts: torque, or force."""
        return "force" if self.torque == "N" else "torque"

    @property
    def velocity(self) -> str:
        """Unit of the velocity."""
        return f"{self.position}/s"

    @property
    def acceleration(self) -> str:
        """Unit of the acceleration."""
        return f"{self.position}/s²"


def joint_units(kinds: Sequence[str] | None, count: int, *, degrees: bool = False) -> tuple[JointUnits, ...]:
    """Gives the units of each joint.

    Args:
        kinds: "revolute" or "prismatic" of each joint, (n,); None where all are revolute.
        count: the number of joints n.
        degrees: whether angles are shown in degrees.

    Returns:
        The units, (n,).

    Raises:
        InputError: an unknown kind, or another number of kinds.
    """
    kinds = ["revolute"] * count if kinds is None else list(kinds)
    if len(kinds) != count:
        raise InputError(f"{len(kinds)} joint kinds", allowed=f"{count}, one per joint")
    units = []
    for joint, kind in enumerate(kinds, start=1):
        if kind not in KINDS:
            raise InputError(f"found the kind {kind!r}", joint=joint, allowed=", ".join(KINDS))
        if kind == "prismatic":
            units.append(JointUnits(factor=1.0, position="m", torque="N"))
        elif degrees:
            units.append(JointUnits(factor=float(np.rad2deg(1.0)), position="°", torque="N m"))
        else:
            units.append(JointUnits(factor=1.0, position="rad", torque="N m"))
    return tuple(units)


def joint_titles(names: Sequence[str] | None, count: int) -> tuple[str, ...]:
    """Gives each joint a title: its number, and its name where that says more.

    Args:
        names: the names, (n,), or None.
        count: the number of joints n.

    Raises:
        InputError: another number of names.
    """
    if names is None:
        return tuple(f"Joint {joint}" for joint in range(1, count + 1))
    if len(names) != count:
        raise InputError(f"{len(names)} joint names", allowed=f"{count}, one per joint")
    return tuple(_title(joint, name) for joint, name in enumerate(names, start=1))


def _title(joint: int, name: str) -> str:
    # "joint_3", "J3" and "3" say no more than the number.
    bare = name.lower().replace("joint", "").replace("axis", "").strip(" _-jaq")
    return f"Joint {joint}" if bare in ("", str(joint)) else f"Joint {joint} · {name}"
