"""The messages as objects. Arrays of joints hold up to ten reals; what was decoded holds ten."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from oed.exports.simple_message.kinds import Comm, Kind, Reply, Valid

Reals = tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Ping:
    """Asks for a sign of life."""

    kind: ClassVar[int] = Kind.PING


@dataclass(frozen=True, slots=True, kw_only=True)
class Bare:
    """A reply without a body: it says what type of message it answers, not which one.

    Attributes:
        kind: the message type.
    """

    kind: int


@dataclass(frozen=True, slots=True, kw_only=True)
class JointPosition:
    """Joint positions.

    Attributes:
        sequence: number of the message.
        positions: [rad or m].
    """

    sequence: int
    positions: Reals
    kind: ClassVar[int] = Kind.JOINT_POSITION


@dataclass(frozen=True, slots=True, kw_only=True)
class Point:
    """A point of a trajectory with one number for the speed.

    Attributes:
        sequence: number of the point, from 0, or a `Special`.
        positions: [rad or m].
        velocity: of the joint nearest to its limit, as a share of the limit.
        duration: of the move to this point [s].
    """

    sequence: int
    positions: Reals
    velocity: float
    duration: float
    kind: ClassVar[int] = Kind.JOINT_TRAJ_PT


@dataclass(frozen=True, slots=True, kw_only=True)
class FullPoint:
    """A point of a trajectory with all that is known of it.

    Attributes:
        robot_id: which robot of the controller.
        sequence: number of the point, from 0, or a `Special`.
        valid: which of the other fields are filled.
        time: since the start of the trajectory [s].
        positions: [rad or m].
        velocities: [rad/s or m/s].
        accelerations: [rad/s2 or m/s2].
    """

    robot_id: int = 0
    sequence: int
    valid: Valid = Valid.TIME | Valid.POSITION | Valid.VELOCITY | Valid.ACCELERATION
    time: float
    positions: Reals
    velocities: Reals
    accelerations: Reals
    kind: ClassVar[int] = Kind.JOINT_TRAJ_PT_FULL


@dataclass(frozen=True, slots=True, kw_only=True)
class JointFeedback:
    """What the joints do.

    Attributes:
        robot_id: which robot of the controller.
        valid: which of the other fields are filled.
        time: on the controller's clock [s].
        positions: [rad or m].
        velocities: [rad/s or m/s].
        accelerations: [rad/s2 or m/s2].
    """

    robot_id: int = 0
    valid: Valid
    time: float
    positions: Reals
    velocities: Reals
    accelerations: Reals
    kind: ClassVar[int] = Kind.JOINT_FEEDBACK


@dataclass(frozen=True, slots=True, kw_only=True)
class TorqueFeedback:
    """What joints and drives do: `JointFeedback` with one more array, a type of our own.

    Attributes:
        robot_id: which robot of the controller.
        valid: which of the other fields are filled, and whether efforts are torques or currents.
        time: on the controller's clock [s].
        positions: [rad or m].
        velocities: [rad/s or m/s].
        accelerations: [rad/s2 or m/s2].
        efforts: joint torques [N m or N] or motor currents [A].
    """

    robot_id: int = 0
    valid: Valid
    time: float
    positions: Reals
    velocities: Reals
    accelerations: Reals
    efforts: Reals
    kind: ClassVar[int] = Kind.TORQUE_FEEDBACK


@dataclass(frozen=True, slots=True, kw_only=True)
class Status:
    """State of the controller: 1 is yes, 0 no, -1 unknown.

    Attributes:
        drives_powered: the drives have power.
        e_stopped: an emergency stop is active.
        error_code: the vendor's; 0 for none.
        in_error: an error stops the robot.
        in_motion: the robot moves.
        mode: 1 manual, 2 automatic, -1 unknown.
        motion_possible: the controller would execute a motion.
    """

    drives_powered: int
    e_stopped: int
    error_code: int
    in_error: int
    in_motion: int
    mode: int
    motion_possible: int
    kind: ClassVar[int] = Kind.STATUS


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionControl:
    """A command to Motoman's driver.

    Attributes:
        robot_id: which robot of the controller.
        sequence: number of the message.
        command: see `Command`.
        data: of no use yet.
    """

    robot_id: int = 0
    sequence: int = 0
    command: int
    data: Reals = ()
    kind: ClassVar[int] = Kind.MOTION_CONTROL


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionReply:
    """What Motoman's driver says to a point or a command.

    Attributes:
        robot_id: which robot of the controller.
        sequence: number of the point, or -1.
        command: command or message type that it answers.
        result: see `Result`.
        subcode: why, in numbers of the driver.
        data: of no use yet.
    """

    robot_id: int = 0
    sequence: int
    command: int
    result: int
    subcode: int = 0
    data: Reals = ()
    kind: ClassVar[int] = Kind.MOTION_REPLY


Message = (
    Ping
    | Bare
    | JointPosition
    | Point
    | FullPoint
    | JointFeedback
    | TorqueFeedback
    | Status
    | MotionControl
    | MotionReply
)


@dataclass(frozen=True, slots=True)
class Frame:
    """A message and how it is meant.

    Attributes:
        message: what is said.
        comm: topic, request or reply.
        reply: the code of a reply; INVALID otherwise.
    """

    message: Message
    comm: Comm = Comm.TOPIC
    reply: Reply = Reply.INVALID
