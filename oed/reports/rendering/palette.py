"""The colours of all figures, by role; distinguishable for colour-blind readers, on light and dark pages."""

from __future__ import annotations

JOINT_COLOURS = ("#5594FF", "#DD8C16", "#B11357", "#45A6AC", "#7922ED", "#9C4209", "#A401A4")
"""One colour per joint, then again from the first.

Any two differ by 30 or more in CIE L*a*b*, also to protanopes and deuteranopes, and each has a contrast of 2.6 or
more to white and to the dark page.
"""

ROLES: dict[str, str] = {
    "main": "#5594FF",
    "second": "#DD8C16",
    "third": "#45A6AC",
    "fourth": "#7922ED",
    "fifth": "#9C4209",
    "measured": "#5594FF",
    "predicted": "#DD8C16",
    "residual": "#B11357",
    "limit": "#D64545",
    "neutral": "#808891",
    "good": "#2E9E6B",
    "warning": "#C98A00",
    "bad": "#D64545",
}
"""Colours by meaning."""

SEQUENCE = ("main", "second", "third", "fourth", "fifth")
"""Roles for series without a meaning of their own, in this order."""

INK = "#7C8590"
"""Text and axes where the background is unknown: readable on white and on black."""

GRID = "rgba(128, 136, 145, 0.25)"
"""Grid lines of the same kind."""


def joint_role(joint: int) -> str:
    """Names the role of a joint, counted from 1.

    Args:
        joint: the joint.
    """
    return f"joint{joint}"


def sequence_role(index: int) -> str:
    """Names the role of the series at ``index``, counted from 0, starting again after the last.

    Args:
        index: the series.
    """
    return SEQUENCE[index % len(SEQUENCE)]


def colour(role: str) -> str:
    """Gives the colour of a role as ``#RRGGBB``.

    Args:
        role: a key of `ROLES`, or that of a joint, such as "joint3".

    Raises:
        KeyError: an unknown role.
    """
    if role.startswith("joint") and role[5:].isdigit():
        return JOINT_COLOURS[(int(role[5:]) - 1) % len(JOINT_COLOURS)]
    return ROLES[role]


def translucent(role: str, opacity: float) -> str:
    """Gives the colour of a role as a CSS ``rgba()``.

    Args:
        role: as for `colour`.
        opacity: from 0 to 1.
    """
    value = colour(role)
    red, green, blue = (int(value[start : start + 2], 16) for start in (1, 3, 5))
    return f"rgba({red}, {green}, {blue}, {opacity:g})"
