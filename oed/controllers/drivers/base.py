"""What a driver program on a controller expects, and what it does otherwise than others."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from oed.exports.simple_message.kinds import MOTION_PORT, STATE_PORT, PointType

Protocol = Literal["simple_message", "rtde", "egm"]
Pings = Literal["answered", "point", "end", "unknown"]
Replies = Literal["bare", "echo", "position", "motoman"]


@dataclass(frozen=True, kw_only=True)
class Driver:
    """A driver program. Client and test controller read the same profile.

    Attributes:
        name: as ``--driver`` takes it.
        title: its name in messages.
        source: where its behaviour is written down.
        protocol: ``simple_message``, ``rtde`` of UR, or ``egm`` of ABB.
        transport: udp or tcp.
        motion_port: takes points.
        state_port: gives feedback.
        byte_order: of all numbers.
        points: ``full`` for JOINT_TRAJ_PT_FULL, ``short`` for JOINT_TRAJ_PT.
        one_form: whether it misreads the other form of points.
        download: whether all points are sent at once, before the robot starts.
        capacity: points that its buffer holds.
        most: points of a trajectory, at most; None for any number.
        replies: ``bare`` without a body, ``echo`` with the point, ``position`` as JOINT_POSITION, ``motoman`` as
            MOTION_REPLY.
        pings: whether a ping is answered, is taken for a point, ends the program, or is unknown.
        commands: whether start and stop are MOTION_CONTROL messages. A point with the number of a stop is refused.
        resting_velocity: share of the speed in short points at rest; 0.1 in ROS-Industrial's client.
        timed: whether it plays in time. Otherwise each move has a speed of its own.
        stands: whether it stands at the last point that came; otherwise an empty buffer in motion is an error.
        one_handshake: whether only the first handshake by UDP is answered, and feedback goes to that address for ever.
        fixed_packets: whether it reads packets of 60 or 68 bytes, whatever they are.
        feedback: ``position``, ``full`` with time, velocity and acceleration, or ``feedback`` with positions only.
        feedback_period: of the feedback [s].
    """

    name: str
    title: str
    source: str
    protocol: Protocol = "simple_message"
    transport: Literal["udp", "tcp"] = "tcp"
    motion_port: int = MOTION_PORT
    state_port: int = STATE_PORT
    byte_order: Literal["little", "big"] = "little"
    points: PointType = "short"
    one_form: bool = True
    download: bool = False
    capacity: int = 100
    most: int | None = None
    replies: Replies = "echo"
    pings: Pings = "answered"
    commands: bool = False
    resting_velocity: float = 0.1
    timed: bool = True
    stands: bool = True
    one_handshake: bool = False
    fixed_packets: bool = False
    feedback: Literal["position", "feedback", "full"] = "position"
    feedback_period: float = 0.025
