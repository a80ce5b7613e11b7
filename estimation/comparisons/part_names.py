"""Names of the parts in which runs differ, in a sentence."""

from __future__ import annotations

from collections.abc import Iterable

from robots.common.plain import joints_in_words


def grouped(parts: Iterable[str]) -> list[str]:
    """Puts the parts of one kind together: friction of joints 1, 2 and 4."""
    kinds: dict[str, list[str]] = {}
    for part in parts:
        kind, _, joint = part.partition(" of joint ")
        kinds.setdefault(kind, []).append(joint)
    return [kind if not joints[0] else f"{kind} of {joints_in_words(joints)}" for kind, joints in kinds.items()]


def listed(names: list[str], most: int = 6) -> str:
    """Lists some names, and says how many more there are."""
    shown = ", ".join(names[:most])
    return shown if len(names) <= most else f"{shown} and {len(names) - most} more"
