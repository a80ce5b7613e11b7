"""Two effects that could be mistaken for each other, as a user names them."""

from __future__ import annotations

import re
from collections.abc import Sequence

from robots.common.errors import InputError
from robots.geometry.urdf_selection import nearest
from robots.robot import Robot
from robots.terms.effects import EFFECTS


def parse_rivals(rivals: str | Sequence[str], robot: Robot) -> list[tuple[str, int | None]]:
    """Reads two effects, each with a joint or without: ``stribeck:2,load_dependent_friction``.

    Raises:
        InputError: not two, an effect that the catalogue lacks, a joint where it cannot act, or one effect twice.
    """
    texts = [part.strip() for part in (rivals.split(",") if isinstance(rivals, str) else rivals)]
    if len(texts) != 2 or not all(texts):
        raise InputError(
            f"--discriminate needs two effects, found {len([t for t in texts if t])}",
            allowed="such as stribeck:2,backlash:2",
        )
    places = [_place(text, robot) for text in texts]
    if places[0][1] is None or places[1][1] is None:
        known = next((joint for _, joint in places if joint is not None), None)
        places = [
            (name, known if joint is None and known in EFFECTS[name].joints(robot) else joint) for name, joint in places
        ]
    if places[0] == places[1]:
        raise InputError(
            f"{texts[0]} and {texts[1]} are the same effect on the same joint",
            allowed="two different effects, or two different joints",
        )
    return places


def _place(text: str, robot: Robot) -> tuple[str, int | None]:
    name, colon, place = (part.strip() for part in text.partition(":"))
    effect = EFFECTS.get(name)
    if effect is None:
        close = nearest(name, EFFECTS)
        raise InputError(f"there is no effect {name!r}", allowed=", ".join(EFFECTS), remedy=close)
    if not colon:
        return name, None
    joints = effect.joints(robot)
    if effect.whole_robot:
        raise InputError(f"{name} acts on the whole robot, not on joint {place} alone", remedy=f"write {name}")
    if not re.fullmatch(r"[0-9]+", place) or int(place) not in joints:
        raise InputError(
            f"{name} cannot act on this joint of {robot.name}",
            joint=place or "(none)",
            allowed=", ".join(str(joint) for joint in joints) or "no joint of this robot",
        )
    return name, int(place)
