"""Feedback messages as rows of a log: position always, velocity, torque or current where there are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from oed.exports.simple_message import (
    JointFeedback,
    JointPosition,
    Message,
    TorqueFeedback,
    Valid,
    WireFormat,
    shortest,
)

RANKS = {JointPosition: 1, JointFeedback: 2, TorqueFeedback: 3}
"""A controller may send several kinds; the one that says most is recorded."""


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
    """

    kind: type
    n: int
    stamped: bool
    velocity: bool
    effort: str
    digits: int

    @property
    def columns(self) -> list[str]:
        """Names of the columns, the time first."""
        prefixes = ["q", *(["dq"] if self.velocity else []), *([self.effort] if self.effort else [])]
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
        return units

    def row(self, message: JointPosition | JointFeedback | TorqueFeedback) -> list[float]:
        """Gives the row of a message, without its time."""
        values = list(message.positions[: self.n])
        if self.velocity and not isinstance(message, JointPosition):
            values += message.velocities[: self.n]
        if self.effort and isinstance(message, TorqueFeedback):
            values += message.efforts[: self.n]
        return values


def layout_of(message: Message, n: int, form: WireFormat) -> Layout | None:
    """Gives the layout of a feedback message; None for another message."""
    digits = 9 if form.real_bytes == 4 else 17
    if isinstance(message, JointPosition):
        return Layout(kind=JointPosition, n=n, stamped=False, velocity=False, effort="", digits=digits)
    if isinstance(message, JointFeedback | TorqueFeedback):
        valid = message.valid
        effort = ""
        if isinstance(message, TorqueFeedback):
            effort = "tau" if Valid.TORQUE in valid else "i" if Valid.CURRENT in valid else ""
        return Layout(
            kind=type(message),
            n=n,
            stamped=Valid.TIME in valid,
            velocity=Valid.VELOCITY in valid,
            effort=effort,
            digits=digits,
        )
    return None


def stamp_of(message: Message, layout: Layout, form: WireFormat) -> float | None:
    """Gives the controller's time [s] of a message; None where it carries none."""
    if not layout.stamped or isinstance(message, JointPosition):
        return None
    time: float = message.time  # type: ignore[union-attr]
    return shortest(time) if form.real_bytes == 4 else time


def is_valid(message: Message, layout: Layout) -> bool:
    """Whether a message holds what the layout needs."""
    if type(message) is not layout.kind:
        return False
    if isinstance(message, JointPosition):
        return True
    needed = Valid.TIME if layout.stamped else Valid.NONE
    needed |= Valid.VELOCITY if layout.velocity else Valid.NONE
    valid: Valid = message.valid  # type: ignore[union-attr]
    return needed in valid
