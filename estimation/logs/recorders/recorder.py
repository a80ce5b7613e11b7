"""A program that records robots into tables, known by its column names."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from estimation.logs.mappings.mapping import LogMapping, PerJoint
from estimation.logs.torque_source import TorqueSource
from robots.common.errors import InputError
from robots.common.tables.table import Table


@dataclass(frozen=True, kw_only=True)
class Recognised:
    """What the columns of a recorded table mean.

    Attributes:
        mapping: of the columns.
        joints: how many there are.
        source: of the torque; None if the table has none.
        remedy: what to record, if it has none.
    """

    mapping: LogMapping
    joints: int
    source: TorqueSource | None
    remedy: str


class Recorder(ABC):
    """One program's tables.

    Attributes:
        name: of what it writes, with its article left out: ``UR RTDE recording``.
        wanted: matches the names of the columns that are read.
    """

    name: ClassVar[str]
    wanted: ClassVar[re.Pattern[str]]

    @abstractmethod
    def recognises(self, names: Sequence[str]) -> bool:
        """Whether a table with these columns was written by this program."""

    @abstractmethod
    def understood(self, table: Table, joints: Sequence[str] | None) -> Recognised:
        """Says what the columns of a table mean.

        Args:
            table: its columns that `wanted` matches.
            joints: names of the robot's joints in its order, where they are known.

        Raises:
            InputError: a column is missing, or what it holds cannot be.
        """


def numbered(table: Table, pattern: str, first: int = 0, count: int | None = None) -> list[str]:
    """Lists the numbered columns of one quantity.

    Args:
        table: with all columns that were read.
        pattern: their names, with ``{}`` for the number.
        first: the number of the first joint.
        count: how many there must be; by default up to the highest number.

    Returns:
        The names in order; empty if there is none.

    Raises:
        InputError: a number is missing.
    """
    before, _, after = pattern.partition("{}")
    form = re.compile(re.escape(before) + r"(\d+)" + re.escape(after))
    numbers = {int(match[1]) for name in table.names if (match := form.fullmatch(name))}
    if not numbers:
        return []
    names = [pattern.format(number) for number in range(first, first + (count or max(numbers) + 1 - first))]
    for name in names:
        if name not in table.columns:
            found = ", ".join(pattern.format(number) for number in sorted(numbers))
            raise InputError(
                f"the column is missing (found: {found})",
                file=table.path,
                column=name,
                row=table.first_row - 1 or None,
                remedy="record the values of all joints",
                kind="missing_column",
            )
    return names


def first_of(table: Table, patterns: Sequence[str], first: int = 0, count: int | None = None) -> tuple[str, PerJoint]:
    """Gives the first quantity that a table has.

    Args:
        table: with all columns that were read.
        patterns: in the order of preference, as in `numbered`; units after a blank are possible.
        first: the number of the first joint.
        count: how many joints there are; by default up to the highest number.

    Returns:
        The pattern, empty if there is none, and its columns.
    """
    for pattern in patterns:
        names = numbered(table, pattern, first, count)
        if names:
            return pattern, PerJoint(columns=names)
    return "", PerJoint(columns=[])


def span(names: Sequence[str]) -> str:
    """Writes the names of columns as ``first to last``."""
    return names[0] if len(names) == 1 else f"{names[0]} to {names[-1]}"


def missing(table: Table, column: str, remedy: str) -> InputError:
    """Returns the error of a column that a recording must have."""
    names = (*table.names, *table.skipped)
    found = ", ".join(names[:10]) + (f", ... ({len(names)} columns)" if len(names) > 10 else "")
    return InputError(
        f"the column is missing (found: {found})",
        file=table.path,
        column=column,
        row=table.first_row - 1 or None,
        remedy=remedy,
        kind="missing_column",
    )
