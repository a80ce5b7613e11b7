"""Which columns of a recording became its torque, and what they mean to the program that wrote them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from robots.common.errors import InputError
from robots.common.records import Record

MEANINGS = ("current", "motor", "without-gravity")
KEY = "torque_is"
"""Of a log's metadata: what its torque column means, until it is converted."""
NO_TORQUE = "no_torque"
"""Name of the note on a log that has neither torques nor currents, and key of a table's remedy for it."""


@dataclass(frozen=True, kw_only=True)
class TorqueSource(Record):
    """Where a log's torques or currents are from.

    Attributes:
        format: what was recognised, such as ``UR RTDE recording``.
        columns: the columns or the message field, as a person writes them.
        quantity: ``torque`` [N m], ``current`` [A], or ``effort`` where the format leaves it open.
        measured: whether it was measured, and not commanded.
        meaning: one clause for the report.
        instead: what to do without the torque constants of the joints; for currents.
    """

    format: str
    columns: str
    quantity: Literal["torque", "current", "effort"]
    measured: bool
    meaning: str
    instead: str | None = None

    def note(self, rows: int) -> dict[str, object]:
        """Gives a note of the reader, which the check of the log reports.

        Args:
            rows: of the log.
        """
        return {
            "name": "torque_source",
            "text": f"read as {self.format}; its {self.quantity} is {self.columns}: {self.meaning}",
            "action": "to use other columns, name them in a mapping (--mapping)",
            "value": rows,
        }


def parse_meaning(text: str, n: int) -> tuple[str, list[int]]:
    """Reads a meaning, with the joints that it concerns.

    Args:
        text: ``current``, ``motor`` or ``without-gravity``; for some joints only, such as ``motor:2,5``.
        n: number of joints.

    Returns:
        The meaning, and the joints, counted from 0.

    Raises:
        InputError: another text.
    """
    name, _, listed = text.strip().partition(":")
    try:
        joints = [int(number) - 1 for number in listed.split(",")] if listed else list(range(n))
    except ValueError:
        joints = [-1]
    if name not in MEANINGS or any(not 0 <= joint < n for joint in joints):
        raise InputError(
            f"torque_is {text!r}",
            allowed=f"{', '.join(MEANINGS)}; with joints from 1 to {n}, such as motor:2,5, if it concerns some only",
        )
    return name, joints
