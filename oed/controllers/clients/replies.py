"""What a reply says of a point or a stop, in the words of each driver."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from oed.exports.simple_message import Bare, Command, Frame, Kind, MotionReply, Reply, Result, Special

REASONS = {
    3001: "a wrong size of the message",
    3003: "a wrong type of message",
    3004: "no such robot (--robot-id)",
    3005: "a wrong number of the point",
    3011: "another start pose",
    3012: "a position out of range",
    3013: "a velocity above the limit",
    3014: "an acceleration above the limit",
    3015: "a point that lacks time, position or velocity",
    3016: "a time out of range",
    5001: "an alarm",
    5002: "an error",
    5003: "an emergency stop",
    5004: "another mode than play",
    5005: "another mode than remote",
    5006: "drives without power",
    5007: "a hold",
    5008: "that its job INIT_ROS has not started",
    5009: "that its job INIT_ROS waits",
    5011: "an active power and force limit",
}
"""Subcodes of `MotionReply` (MotoPlus/SimpleMessage.h)."""


class Verdict(Enum):
    """What became of a point."""

    ACCEPTED = "accepted"
    BUSY = "busy"
    REFUSED = "refused"
    OTHER = "other"


@dataclass(frozen=True, slots=True)
class Answer:
    """What a reply says.

    Attributes:
        verdict: of a point; OTHER for the reply to something else.
        number: of the point; None where the reply has none.
        why: a point is refused; empty where the reply does not say it.
    """

    verdict: Verdict
    number: int | None = None
    why: str = ""


def answer_of(frame: Frame, kind: int) -> Answer:
    """Reads a reply to a point.

    A reply has the type of the point, JOINT_POSITION as of Fanuc's driver, or MOTION_REPLY as of Motoman's.

    Args:
        frame: a reply.
        kind: message type of the points.
    """
    message = frame.message
    if isinstance(message, MotionReply):
        if message.command != kind:
            return Answer(Verdict.OTHER)
        if message.result == Result.BUSY:
            return Answer(Verdict.BUSY, message.sequence)
        refused = message.result != Result.SUCCESS
        return Answer(Verdict.REFUSED if refused else Verdict.ACCEPTED, message.sequence, reason(message))
    if message.kind not in (kind, Kind.JOINT_POSITION):
        return Answer(Verdict.OTHER)
    verdict = Verdict.ACCEPTED if frame.reply == Reply.SUCCESS else Verdict.REFUSED
    return Answer(verdict, None if isinstance(message, Bare) else message.sequence)  # type: ignore[union-attr]


def confirms_stop(frame: Frame, kind: int) -> bool:
    """Whether a reply may be that to a stop.

    Args:
        frame: a reply.
        kind: message type of the points.
    """
    message = frame.message
    if isinstance(message, MotionReply):
        return message.command == Command.STOP and message.result == Result.SUCCESS
    if message.kind not in (kind, Kind.JOINT_POSITION) or frame.reply != Reply.SUCCESS:
        return False
    return isinstance(message, Bare) or getattr(message, "sequence", None) == Special.STOP


def reason(reply: MotionReply) -> str:
    """Says why Motoman's driver refuses something; empty for a success."""
    if reply.result == Result.SUCCESS:
        return ""
    known = {int(result): result.name.lower().replace("_", " ") for result in Result}
    named = known.get(reply.result, f"result {reply.result}")
    return REASONS.get(reply.subcode, f"{named}, subcode {reply.subcode}" if reply.subcode else named)


def described(frame: Frame) -> str:
    """Names a message that was not expected."""
    message = frame.message
    number = getattr(message, "sequence", None)
    return f"a message of type {int(message.kind)}" + ("" if number is None else f" with number {number}")
