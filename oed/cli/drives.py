"""Options of commands about drives: lists of names, and the order of a log's joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

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


def limits_of(chains: Sequence[Robot], order: JointOrder) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Gives lower and upper positions of a log's joints in its order [rad or m]."""
    lower = [float(value) for chain in chains for value in chain.limits.lower]
    upper = [float(value) for chain in chains for value in chain.limits.upper]
    return np.array(order.put(lower)), np.array(order.put(upper))


def logs_from(
    paths: Sequence[Path], limits: tuple[NDArray[np.float64], NDArray[np.float64]], options: Mapping[str, Any]
) -> list[Log]:
    """Reads logs with commands: files of any known format, and LeRobot data sets.

    Args:
        paths: files and folders.
        limits: of the joints, by which normalised positions of a data set are read.
        options: of `read_logs`.

    Raises:
        InputError: see `read_logs` and `read_lerobot`.
    """
    from estimation.logs import read_logs
    from estimation.logs.readers.lerobot import is_lerobot, read_lerobot

    sets = [path for path in paths if is_lerobot(path)]
    files = [path for path in paths if path not in sets]
    found = list(read_logs(files, **options)) if files else []
    for path in sets:
        found += read_lerobot(path, options["joints"], limits)
    return found


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
