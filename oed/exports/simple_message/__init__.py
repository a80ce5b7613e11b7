"""The ROS-Industrial simple_message protocol: messages, and their bytes (industrial_core 0.7, REP-I0004)."""

from oed.exports.simple_message.codec import DEFAULT, WireFormat, shortest
from oed.exports.simple_message.errors import MessageError
from oed.exports.simple_message.kinds import Comm, Command, Kind, Reply, Result, Special, Valid
from oed.exports.simple_message.messages import (
    Bare,
    Frame,
    FullPoint,
    JointFeedback,
    JointPosition,
    Message,
    MotionControl,
    MotionReply,
    Ping,
    Point,
    Status,
    TorqueFeedback,
)
from oed.exports.simple_message.points import trajectory_points
from oed.exports.simple_message.splitting import Splitter

__all__ = [
    "DEFAULT",
    "Bare",
    "Comm",
    "Command",
    "Frame",
    "FullPoint",
    "JointFeedback",
    "JointPosition",
    "Kind",
    "Message",
    "MessageError",
    "MotionControl",
    "MotionReply",
    "Ping",
    "Point",
    "Reply",
    "Result",
    "Special",
    "Splitter",
    "Status",
    "TorqueFeedback",
    "Valid",
    "WireFormat",
    "shortest",
    "trajectory_points",
]
