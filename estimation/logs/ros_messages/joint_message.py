"""A type of ROS message that carries the state of joints."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

# Types that a definition below may use without repeating them.
HEADER = "std_msgs/Header header\n"


@dataclass(frozen=True, kw_only=True)
class JointValues:
    """What one message says; an empty sequence is a quantity that it lacks.

    Attributes:
        names: of the joints; empty if the message has none.
        position: one value a joint [rad or m].
        velocity: [rad/s or m/s].
        effort: [N m or N], as the sender means it.
        stamp: the message's own time [s]; None or 0 if it has none.
        command: what was commanded [rad or m].
    """

    names: Sequence[str]
    position: Sequence[float]
    velocity: Sequence[float]
    effort: Sequence[float]
    stamp: float | None
    command: Sequence[float] = ()


class JointMessage(ABC):
    """One type of message.

    Attributes:
        kind: the type, as ROS 2 writes it.
        field: of the effort, for people.
        quantity: of the effort.
        measured: whether the effort is measured.
        meaning: of the effort.
        definition: the beginning of the message, for bags that do not hold it; empty if versions differ.
    """

    kind: ClassVar[str]
    field: ClassVar[str]
    quantity: ClassVar[Literal["torque", "effort"]]
    measured: ClassVar[bool] = True
    meaning: ClassVar[str]
    definition: ClassVar[str] = ""

    @abstractmethod
    def values(self, message: Any) -> JointValues:
        """Reads a message of this type."""


def stamp_of(message: Any) -> float:
    """Gives the time of a message's header [s]."""
    stamp = message.header.stamp
    return float(stamp.sec) + 1e-9 * float(stamp.nanosec)
