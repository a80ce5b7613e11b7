"""Joints of a message or a table by their names, vendors' prefixes aside."""

from __future__ import annotations

from collections.abc import Sequence


def places(found: Sequence[str], wanted: Sequence[str]) -> list[int] | None:
    """Finds where each joint of a robot stands among names.

    Names may have another prefix than the robot's: ``left_elbow_joint`` is ``elbow_joint``, and ``fr3_joint1`` is
    ``panda_joint1``, if that leaves no doubt.

    Args:
        found: in the order of the message.
        wanted: the robot's, in its order.

    Returns:
        One place a joint; None if one is missing, or several could be meant.
    """
    known = list(found)
    if set(wanted) <= set(known):
        return [known.index(name) for name in wanted]
    return _by_end(known, wanted) or _without_prefix(known, wanted)


def _by_end(found: list[str], wanted: Sequence[str]) -> list[int] | None:
    """One name is the other with something and a separator in front."""
    order = []
    for name in wanted:
        fits = [place for place, other in enumerate(found) if _ends(other, name) or _ends(name, other)]
        if len(fits) != 1:
            return None
        order.append(fits[0])
    return order if len(set(order)) == len(order) else None


def _ends(whole: str, end: str) -> bool:
    return whole == end or (whole.endswith(end) and whole[: -len(end)][-1] in "_-/.:")


def _without_prefix(found: list[str], wanted: Sequence[str]) -> list[int] | None:
    """Each list has a first word of its own, such as a vendor's name for the arm."""
    if len(wanted) < 2:
        return None
    own = wanted[0].split("_")[0] + "_"
    if not all(name.startswith(own) for name in wanted):
        return None
    for other in dict.fromkeys(name.split("_")[0] + "_" for name in found):
        names = [other + name.removeprefix(own) for name in wanted]
        if set(names) <= set(found):
            return [found.index(name) for name in names]
    return None
