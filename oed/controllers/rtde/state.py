"""What a UR controller reports in each cycle, as feedback and as its state."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Any

from oed.controllers.rtde.feedback import StateFeedback
from oed.controllers.rtde.packages import AS_TORQUE, FIELDS, PLAYED, UR_JOINTS, body_format, opened
from oed.exports.simple_message import Frame, MessageError, Status, Valid

TYPES = [*FIELDS.values(), FIELDS["actual_q"]]
"""Types of a data package with `AS_TORQUE` behind the other fields."""


class Safety(IntEnum):
    """Safety modes."""

    NORMAL = 1
    REDUCED = 2
    PROTECTIVE_STOP = 3
    RECOVERY = 4
    SAFEGUARD_STOP = 5
    SYSTEM_EMERGENCY_STOP = 6
    ROBOT_EMERGENCY_STOP = 7
    VIOLATION = 8
    FAULT = 9


ROBOT_RUNNING = 7
"""The robot mode in which brakes are released."""

PROGRAM_STOPPED, PROGRAM_PLAYING = 1, 2
"""States of a program."""


@dataclass(frozen=True, slots=True, kw_only=True)
class UrStatus(Status):
    """State of a UR controller.

    Attributes:
        error: the safety mode in words; empty where it allows a motion.
    """

    error: str = ""


def status_of(robot_mode: int, safety_mode: int, runtime_state: int) -> UrStatus:
    """Reads the modes of a controller. It moves while a program plays, so that another client's counts."""
    stopped = safety_mode in (Safety.SYSTEM_EMERGENCY_STOP, Safety.ROBOT_EMERGENCY_STOP)
    fine = safety_mode in (Safety.NORMAL, Safety.REDUCED)
    wrong = not (fine or stopped)
    known = {int(mode): mode.name.lower().replace("_", " ") for mode in Safety}
    return UrStatus(
        drives_powered=int(robot_mode == ROBOT_RUNNING),
        e_stopped=int(stopped),
        error_code=safety_mode if wrong else 0,
        in_error=int(wrong),
        in_motion=int(runtime_state == PROGRAM_PLAYING),
        mode=-1,
        motion_possible=int(fine and robot_mode == ROBOT_RUNNING),
        error=f"safety mode {safety_mode} ({known.get(safety_mode, 'unknown')})" if wrong else "",
    )


@dataclass(frozen=True)
class RtdeForm:
    """Decodes data packages, where simple_message has a `WireFormat`."""

    real_bytes: int = 8

    def decode(self, data: bytes) -> Frame:
        """Reads a data package with all fields; NaN where the controller has none.

        Raises:
            MessageError: a package of another size.
        """
        form = body_format(TYPES)
        _, body = opened(data)
        if len(body) != form.size:
            raise MessageError(f"a data package of {len(data)} bytes")
        values = iter(form.unpack(body)[1:])
        found: dict[str, Any] = {
            name: tuple(next(values) for _ in range(UR_JOINTS)) if kind == "VECTOR6D" else next(values)
            for name, kind in zip([*FIELDS, AS_TORQUE], TYPES, strict=True)
        }
        currents, torques = found["actual_current"], found[AS_TORQUE]
        with_torque = torques[0] == torques[0]
        further = {"temp": ("degC", found["joint_temperatures"]), "target_moment": ("N m", found["target_moment"])}
        if with_torque:
            further["i"] = ("A", currents)
        return Frame(
            StateFeedback(
                valid=Valid.TIME | Valid.POSITION | Valid.VELOCITY | (Valid.TORQUE if with_torque else Valid.CURRENT),
                time=found["timestamp"],
                positions=found["actual_q"],
                velocities=found["actual_qd"],
                accelerations=(),
                efforts=torques if with_torque else currents,
                further=further,
                played=found[PLAYED],
                status=status_of(found["robot_mode"], found["safety_mode"], found["runtime_state"]),
            )
        )

    def encode(self, frame: Frame) -> bytes:
        """Nothing is answered: RTDE has no requests of the controller."""
        return b""
