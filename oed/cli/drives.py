"""Options of commands about drives: lists of names, and the order of a log's joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeVar

from robots.common.errors import InputError

if TYPE_CHECKING:
    from robots.robot import Robot
    from robots.signals import Log

T = TypeVar("T")


@dataclass(frozen=True)
class JointOrder:
    """The joints of a log in its order, and where each chain's joints are among them.

    Attributes:
        names: of the log's joints.
        places: of the chains' joints among them.
    """

    names: tuple[str, ...]
    places: tuple[int, ...]

    def put(self, values: Sequence[T]) -> tuple[T, ...]:
        """Puts one value per joint of the chains into the order of the log."""
        return tuple(values[self.places.index(k)] for k in range(len(self.places)))

    def sorted(self, log: Log) -> Log:
        """Puts a log's joints into the order of the chains."""
        order = list(self.places)
        if order == sorted(order):
            return log
        kept = {
            key: value[:, order]
            for key in ("q", "command", "tau", "current", "dq", "ddq", "temperature", "qlink")
            if (value := getattr(log, key)) is not None
        }
        return replace(log, **kept)


def joint_order(chains: Sequence[Robot], stated: Sequence[str] | None) -> JointOrder:
    """Finds the order of a log's joints: as stated, else that of the chains."""
    names = tuple(name for chain in chains for name in chain.joint_names)
    if stated is None:
        return JointOrder(names, tuple(range(len(names))))
    return JointOrder(tuple(stated), tuple(list(stated).index(name) for name in names))


def named(text: str | None) -> tuple[str, ...] | None:
    """Reads names, separated by commas."""
    return tuple(part.strip() for part in text.split(",") if part.strip()) if text else None


def positions(lock: Sequence[str] | None) -> dict[str, float] | None:
    """Reads positions of locked joints, each name=value [rad or m].

    Raises:
        InputError: something else.
    """
    found = {}
    for item in lock or ():
        name, _, value = item.partition("=")
        try:
            found[name.strip()] = float(value)
        except ValueError:
            raise InputError(f"--lock {item}", allowed="name=value with the value in rad or m") from None
    return found or None
