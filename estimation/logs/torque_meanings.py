"""Names of what a torque column may mean."""

from __future__ import annotations

from robots.common.errors import InputError

MEANINGS = ("current", "motor", "without-gravity")
KEY = "torque_is"
"""Of a log's metadata: what its torque column means, until it is converted."""


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
