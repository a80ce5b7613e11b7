"""Options that name a robot, and the robot that they name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from robots.common.errors import InputError
from robots.common.options import Names, Option, names

if TYPE_CHECKING:
    from robots.drives import DescribedDrives
    from robots.robot import Robot

CATALOGUE = "robots.loading:catalogue"
"""Where the names of robots are listed, for shells."""


def locked_positions(texts: Sequence[str]) -> dict[str, float] | None:
    """Reads positions of locked joints by name [rad or m]; None without any.

    Args:
        texts: each name=value.

    Raises:
        InputError: something else.
    """
    found = {}
    for item in texts:
        name, _, value = item.partition("=")
        try:
            found[name.strip()] = float(value)
        except ValueError:
            raise InputError(
                f"--lock {item}", allowed="name=value with the value in rad or m, such as elbow_joint=1.57"
            ) from None
    return found or None


@dataclass(frozen=True, kw_only=True)
class Chain:
    """Which joints of a description are the robot's.

    Attributes:
        tip: URDF or MJCF with branches: the link at which the chain ends.
        joints: URDF or MJCF with branches: the joints of the chain, comma-separated.
        lock: hold a joint at a position [rad or m], as name=value. Repeatable.
    """

    section: ClassVar[str] = "Robot"

    tip: str | None = None
    joints: Names = None
    lock: tuple[str, ...] = ()

    def load(self, robot: str, *, unlimited: bool = True, assume_masses: float | None = None) -> Robot:
        """Loads a robot.

        Args:
            robot: of the catalogue, or a file.
            unlimited: whether joints need no position limits; only commands that plan a motion need them.
            assume_masses: rated payload of a robot whose masses are assumed [kg].

        Raises:
            InputError: see `robots.loading.load_robot`; or a lock that is not name=value.
        """
        from robots.loading import load_robot

        joints, locked = self.joints, locked_positions(self.lock)
        return load_robot(
            robot, tip=self.tip, joints=joints, locked=locked, unlimited=unlimited, assume_masses=assume_masses
        )


@dataclass(frozen=True, kw_only=True)
class RobotOptions:
    """The robot of a command.

    Attributes:
        robot: the robot: a catalogue name (er3a, ur10, panda), a URDF or xacro, an MJCF (MuJoCo), or a robot YAML.
    """

    section: ClassVar[str] = "Robot"

    robot: Annotated[str, Option(names_file=True, choices=CATALOGUE)]
    chain: Chain = Chain()

    def load(self, robot: str | None = None) -> Robot:
        """Loads the robot.

        Args:
            robot: another one, with these joints.

        Raises:
            InputError: see `Chain.load`.
        """
        assumed, unlimited = getattr(self, "assume_masses", None), getattr(self, "unlimited", True)
        return self.chain.load(robot or self.robot, unlimited=unlimited, assume_masses=assumed)


@dataclass(frozen=True, kw_only=True)
class SimulatedRobot(RobotOptions):
    """The robot of a command that needs masses.

    Attributes:
        assume_masses: for a description without masses: assume those of a usual arm of its size and this rated payload
            [kg]. All results say so.
    """

    assume_masses: Annotated[float | None, Option(shown="KG")] = None


@dataclass(frozen=True, kw_only=True)
class PlannedRobot(SimulatedRobot):
    """The robot of a command that plans a motion.

    Attributes:
        unlimited: URDF: accept revolute and prismatic joints without position limits.
    """

    unlimited: bool = False


@dataclass(frozen=True, kw_only=True)
class FileRobot(SimulatedRobot):
    """The robot of a command that reads a trajectory.

    Attributes:
        robot: the robot: a catalogue name (er3a, ur10, panda), a URDF or xacro, an MJCF (MuJoCo), or a robot YAML.
            Default: the robot named in the trajectory file.
    """

    robot: Annotated[str, Option(names_file=True, choices=CATALOGUE)] = ""

    def load_for(self, metadata: Mapping[str, Any], file: Path) -> Robot:
        """Loads the robot that the option names, else the one that a trajectory file names.

        Args:
            metadata: of the file.
            file: for the message.

        Raises:
            InputError: neither names one; or see `RobotOptions.load`.
        """
        stated = str(metadata.get("robot") or "")
        if not self.robot and not stated:
            raise InputError("the file does not name its robot", file=file, remedy="give --robot")
        if not self.robot and Path(stated).suffix and not Path(stated).is_file():
            raise InputError(f"the file names the robot {stated}, which is not there", file=file, remedy="give --robot")
        return self.load(self.robot or stated)


@dataclass(frozen=True, kw_only=True)
class Drives:
    """A robot whose drives are looked at, and what is known of them.

    Attributes:
        robot: the robot: a catalogue name (er3a, ur10, panda), a URDF or xacro, an MJCF (MuJoCo), or a robot YAML.
            Branches are read from a base that is held.
        gains: a YAML file with the control law and its gains. Default: the actuators of the MJCF.
        joints: the joints of the log in its order, comma-separated; others are locked.
        lock: hold a joint at a position [rad or m], as name=value. Repeatable.
    """

    robot: Annotated[str, Option(names_file=True, section="Robot", choices=CATALOGUE)]
    gains: Path | None = None
    joints: Annotated[tuple[str, ...] | None, Option(reads=names, section="Robot")] = None
    lock: Annotated[tuple[str, ...], Option(section="Robot")] = ()

    @property
    def locked(self) -> dict[str, float] | None:
        """Positions of locked joints.

        Raises:
            InputError: a lock that is not name=value.
        """
        return locked_positions(self.lock)

    def load(self) -> tuple[tuple[Robot, ...], DescribedDrives]:
        """Loads the chains of the robot, and what is known of their drives.

        Raises:
            InputError: see `load_branches` and `described_drives`; or a lock that is not name=value.
        """
        from robots.drives import described_drives, load_branches

        chains = load_branches(self.robot, joints=self.joints, locked=self.locked)
        return chains, described_drives(chains, self.gains)
