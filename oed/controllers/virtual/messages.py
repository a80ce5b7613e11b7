"""What the controller says: replies, feedback and status."""

from __future__ import annotations

from oed.controllers.virtual.options import ControllerOptions
from oed.controllers.virtual.player import Player, Sample
from oed.exports.simple_message import (
    Bare,
    Comm,
    Frame,
    JointFeedback,
    JointPosition,
    Ping,
    Reply,
    Status,
    TorqueFeedback,
    Valid,
)
from oed.exports.simple_message.kinds import AUTO, MANUAL

SAMPLED = Valid.TIME | Valid.POSITION | Valid.VELOCITY | Valid.ACCELERATION


def reply_frame(request: Frame, code: Reply, options: ControllerOptions) -> Frame:
    """Answers a request: without a body as the thesis' program does, or with the message itself."""
    bare = options.replies == "bare" or isinstance(request.message, Ping)
    message = Bare(kind=request.message.kind) if bare else request.message
    return Frame(Ping() if isinstance(request.message, Ping) else message, Comm.REPLY, code)


def feedback_frame(sample: Sample, clock: float, number: int, kind: str) -> Frame:
    """Reports what the robot does.

    Args:
        sample: of one time.
        clock: the controller's time [s].
        number: of the message.
        kind: see `ControllerOptions.feedback`.
    """
    q, dq, ddq = (tuple(values.tolist()) for values in (sample.q, sample.dq, sample.ddq))
    if kind == "position":
        return Frame(JointPosition(sequence=number, positions=q))
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
