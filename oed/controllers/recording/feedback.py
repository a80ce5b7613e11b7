"""Feedback messages as rows of a log: position always, velocity, torque or current where there are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from oed.controllers.rtde.feedback import StateFeedback
from oed.exports.simple_message import (
    Frame,
    JointFeedback,
    JointPosition,
    Message,
    TorqueFeedback,
    Valid,
    shortest,
)

COARSE_CLOCK_STEP = 0.002
"""Step of a clock [s] above which rows have the times of their arrival. Reals of 4 bytes reach it after 9 hours."""


RANKS = {JointPosition: 1, JointFeedback: 2, TorqueFeedback: 3, StateFeedback: 4}
"""A controller may send several kinds; the one that says most is recorded."""


class MessageForm(Protocol):
    """How messages are bytes: a `WireFormat`, or RTDE's."""

    @property
    def real_bytes(self) -> int:
        """Bytes of a real number."""
        ...

    def decode(self, data: bytes) -> Frame:
        """Reads a message."""
        ...

    def encode(self, frame: Frame) -> bytes:
        """Writes a message."""
        ...


EFFORTS = {"tau": {Valid.TORQUE: "torque"}, "i": {Valid.CURRENT: "current"}}


@dataclass(frozen=True, kw_only=True)
class Layout:
    """What of a kind of feedback is recorded.

    Attributes:
        kind: the class of the messages.
        n: number of joints.
        stamped: whether messages carry the controller's time.
        velocity: whether they carry velocities.
        effort: ``tau``, ``i`` or nothing.
        digits: significant digits of the reals.
        further: other quantities, with their units.
    """

    kind: type
    n: int
    stamped: bool
    velocity: bool
    effort: str
    digits: int
    further: Mapping[str, str] = field(default_factory=dict)

    @property
    def columns(self) -> list[str]:
        """Names of the columns, the time first."""
        prefixes = ["q", *(["dq"] if self.velocity else []), *([self.effort] if self.effort else []), *self.further]
        return ["t", *(f"{prefix}{joint + 1}" for prefix in prefixes for joint in range(self.n))]

    def units(self, position: Sequence[str]) -> dict[str, str]:
        """Units by column.

        Args:
            position: of each joint, rad or m.
        """
        units = {"t": "s"}
        for joint, unit in enumerate(position, start=1):
            units[f"q{joint}"] = unit
            if self.velocity:
                units[f"dq{joint}"] = f"{unit}/s"
            if self.effort == "tau":
                units[f"tau{joint}"] = "N m" if unit == "rad" else "N"
            elif self.effort:
                units[f"i{joint}"] = "A"
            units |= {f"{name}{joint}": unit for name, unit in self.further.items()}
        return units

    def row(self, message: JointPosition | JointFeedback | TorqueFeedback) -> list[float]:
        """Gives the row of a message, without its time."""
        values = list(message.positions[: self.n])
        if self.velocity and not isinstance(message, JointPosition):
            values += message.velocities[: self.n]
        if self.effort and isinstance(message, TorqueFeedback):
            values += message.efforts[: self.n]
        if isinstance(message, StateFeedback):
            for _, further in message.further.values():
                values += further[: self.n]
        return values


def layout_of(message: Message, n: int, form: MessageForm) -> Layout | None:
    """Gives the layout of a feedback message; None for another message, or one without valid positions."""
    digits = 9 if form.real_bytes == 4 else 17
    if isinstance(message, JointPosition):
        return Layout(kind=JointPosition, n=n, stamped=False, velocity=False, effort="", digits=digits)
    if isinstance(message, JointFeedback | TorqueFeedback) and Valid.POSITION in message.valid:
        valid = message.valid
        effort = ""
        if isinstance(message, TorqueFeedback):
            effort = "tau" if Valid.TORQUE in valid else "i" if Valid.CURRENT in valid else ""
        return Layout(
            kind=type(message),
            n=n,
            stamped=Valid.TIME in valid and _step(message.time, form) <= COARSE_CLOCK_STEP,
            velocity=Valid.VELOCITY in valid,
            effort=effort,
            digits=digits,
            further={name: unit for name, (unit, _) in getattr(message, "further", {}).items()},
        )
    return None


def stamp_of(message: Message, layout: Layout, form: MessageForm) -> float | None:
    """Gives the controller's time [s] of a message; None where it carries none."""
    if not layout.stamped or isinstance(message, JointPosition):
        return None
    time: float = message.time  # type: ignore[union-attr]
    return shortest(time) if form.real_bytes == 4 else time


def missing_in(message: Message, layout: Layout | None) -> str:
    """Names what a feedback message lacks: its position, or something else that the layout needs; empty for nothing."""
    if isinstance(message, JointPosition):
        return ""
    needed = {Valid.POSITION: "position"}
    if layout is not None:
        needed |= {Valid.TIME: "time"} if layout.stamped else {}
        needed |= {Valid.VELOCITY: "velocity"} if layout.velocity else {}
        needed |= EFFORTS.get(layout.effort, {})
    valid: Valid = message.valid  # type: ignore[union-attr]
    return " and ".join(name for bit, name in needed.items() if bit not in valid)


def coarse_clock(message: Message, form: MessageForm) -> str:
    """Says why rows have no times of the controller though its messages carry them; empty if they have."""
    if isinstance(message, JointPosition) or Valid.TIME not in message.valid:  # type: ignore[union-attr]
        return ""
    time: float = message.time  # type: ignore[union-attr]
    step = _step(time, form)
    return (
        f"the controller's clock is at {time:.0f} s and counts in steps of {1e3 * step:.1f} ms there, as a real of 4 "
        "bytes does: rows have the times of their arrival. Its own times need a restart of the controller"
        if step > COARSE_CLOCK_STEP
        else ""
    )


def _step(time: float, form: MessageForm) -> float:
    """Gives the distance of a time from the next one that a message can carry [s]."""
    return float(np.spacing(np.float32(abs(time)))) if form.real_bytes == 4 else 0.0
