"""What Motoman's driver does with messages: it starts and stops on commands, and is busy at a full buffer."""

from __future__ import annotations

import time
from enum import IntEnum

from oed.controllers.virtual.buffer import Outcome
from oed.controllers.virtual.messages import motion_reply
from oed.controllers.virtual.player import Player
from oed.exports.simple_message import Command, Frame, FullPoint, Message, MotionControl, Result, Valid

NEEDED = Valid.TIME | Valid.POSITION | Valid.VELOCITY


class Reason(IntEnum):
    """Why a message is refused, as the driver's replies state it."""

    NO_TYPE = 3003
    NO_NUMBER = 3005
    NO_COMMAND = 3006
    OTHER_START = 3011
    LACKING = 3015
    NOT_READY = 5000
    NOT_STARTED = 5008


class MotomanProgram:
    """Answers the messages at the motion port."""

    def __init__(self) -> None:
        self._started = False

    def answer(self, message: Message, player: Player, ready: bool) -> Frame:
        """Does what a message says.

        Args:
            message: a command or a point.
            player: plays the points.
            ready: whether the controller may move.
        """
        if isinstance(message, MotionControl):
            return self._command(message, player, ready)
        if not isinstance(message, FullPoint):
            return motion_reply(message, Result.INVALID, Reason.NO_TYPE)
        if not (self._started and ready):
            return motion_reply(message, Result.NOT_READY, Reason.NOT_READY if self._started else Reason.NOT_STARTED)
        if message.valid & NEEDED != NEEDED:
            return motion_reply(message, Result.INVALID, Reason.LACKING)
        if message.sequence < 0:
            return motion_reply(message, Result.INVALID, Reason.NO_NUMBER)
        outcome = player.put(message, time.monotonic(), streaming=True)
        if outcome == Outcome.FULL:
            return motion_reply(message, Result.BUSY)
        if outcome is None:
            player.clear_error()
            return motion_reply(message, Result.INVALID, Reason.OTHER_START)
        return motion_reply(message, Result.SUCCESS)

    def _command(self, message: MotionControl, player: Player, ready: bool) -> Frame:
        if message.command == Command.STOP:
            player.stop()
            return motion_reply(message, Result.SUCCESS)
        if message.command in (Command.START, Command.CHECK_READY):
            self._started = ready and (self._started or message.command == Command.START)
            if self._started:
                return motion_reply(message, Result.SUCCESS)
            result = Result.NOT_READY if message.command == Command.START else Result.FAILURE
            return motion_reply(message, result, Reason.NOT_STARTED if ready else Reason.NOT_READY)
        return motion_reply(message, Result.INVALID, Reason.NO_COMMAND)
