"""What the controller says: replies, feedback and status."""

from __future__ import annotations

from oed.controllers.virtual.player import Player, Sample
from oed.controllers.virtual_options import ControllerOptions
from oed.exports.simple_message import (
    Bare,
    Comm,
    Frame,
    JointFeedback,
    JointPosition,
    Message,
    MotionControl,
    MotionReply,
    Ping,
    Reply,
    Result,
    Status,
    TorqueFeedback,
    Valid,
)
from oed.exports.simple_message.kinds import AUTO, MANUAL

SAMPLED = Valid.TIME | Valid.POSITION | Valid.VELOCITY | Valid.ACCELERATION


def reply_frame(request: Frame, code: Reply, options: ControllerOptions) -> Frame:
    """Answers a request: without a body as the thesis' program does, as JOINT_POSITION, or with the message itself."""
    asked = request.message
    if isinstance(asked, Ping):
        return Frame(Ping(), Comm.REPLY, code)
    if options.replies == "bare":
        return Frame(Bare(kind=asked.kind), Comm.REPLY, code)
    if options.replies == "position":
        return Frame(JointPosition(sequence=getattr(asked, "sequence", 0), positions=()), Comm.REPLY, code)
    return Frame(asked, Comm.REPLY, code)


def motion_reply(asked: Message, result: Result, subcode: int = 0) -> Frame:
    """Answers as Motoman's driver does: the code of the reply is SUCCESS, whatever the result."""
    command = asked.command if isinstance(asked, MotionControl) else asked.kind
    return Frame(
        MotionReply(
            robot_id=getattr(asked, "robot_id", -1),
            sequence=getattr(asked, "sequence", -1),
            command=command,
            result=result,
            subcode=subcode,
        ),
        Comm.REPLY,
        Reply.SUCCESS,
    )


def feedback_frame(sample: Sample, clock: float, number: int, kind: str, external: tuple[float, ...] = ()) -> Frame:
    """Reports what the robot does.

    Args:
        sample: of one time.
        clock: the controller's time [s].
        number: of the message.
        kind: see `ControllerOptions.feedback`.
        external: positions of further axes.
    """
    q, dq, ddq = (tuple(values.tolist()) for values in (sample.q, sample.dq, sample.ddq))
    q = (*q, *external)
    if kind == "position":
        return Frame(JointPosition(sequence=number, positions=q))
    if kind == "feedback":
        return Frame(
            JointFeedback(valid=Valid.POSITION, time=0.0, positions=q, velocities=(), accelerations=()),
        )
    if kind == "full" or sample.tau is None:
        return Frame(JointFeedback(valid=SAMPLED, time=clock, positions=q, velocities=dq, accelerations=ddq))
    return Frame(
        TorqueFeedback(
            valid=SAMPLED | Valid.TORQUE,
            time=clock,
            positions=q,
            velocities=dq,
            accelerations=ddq,
            efforts=tuple(sample.tau.tolist()),
        )
    )


def status_frame(player: Player, state: str) -> Frame:
    """Reports the controller's state."""
    error = player.error or (99 if state == "error" else 0)
    ready = state == "ready" and not error
    return Frame(
        Status(
            drives_powered=int(state != "drives-off" and state != "e-stop"),
            e_stopped=int(state == "e-stop"),
            error_code=error,
            in_error=int(error != 0),
            in_motion=int(player.moving),
            mode=MANUAL if state == "manual" else AUTO,
            motion_possible=int(ready),
        )
    )
