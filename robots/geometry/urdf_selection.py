"""Which joints of a branched URDF move: by tip link, by joint names, or the only ones there are."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Protocol

from robots.common.errors import InputError
from robots.geometry.urdf_xml import UrdfJoint, UrdfLink

Choice = tuple[str | None, Sequence[str] | None, Mapping[str, float] | None]  # tip, joints, locked
_LISTED_TIPS = 12  # a humanoid has dozens of tips; a longer list does not help


class _Tree(Protocol):
    file: str
    kind: str
    links: dict[str, UrdfLink]
    joints: dict[str, UrdfJoint]

    @property
    def leaves(self) -> tuple[str, ...]: ...

    def path(self, link: str) -> tuple[UrdfJoint, ...]: ...


@dataclass(frozen=True, kw_only=True, eq=False)
class Selection:
    """The chain's choice: moving joints from the root outwards, the flange's link, and locked positions as stated."""

    moving: tuple[UrdfJoint, ...]
    tip: str
    locked: dict[str, float]


def digest_of(*parts: bytes | str | Choice) -> str:
    """Gives the SHA-256 of files, their digests and a choice of joints, which makes another robot of the same file."""
    sha = hashlib.sha256()
    for part in parts:
        if isinstance(part, tuple):
            tip, joints, locked = part
            positions = {name: float(value) for name, value in (locked or {}).items()}
            part = json.dumps([tip, list(joints or []), positions], sort_keys=True)
        sha.update(part if isinstance(part, bytes) else part.encode())
    return sha.hexdigest()


def nearest(name: str, choices: Iterable[str]) -> str | None:
    """A remedy that names the most similar choice.

    Args:
        name: what was found.
        choices: what exists.

    Returns:
        A clause such as "did you mean 'tool0'?", or None when nothing is near.
    """
    by_lower = {choice.lower(): choice for choice in choices}
    close = get_close_matches(name.lower(), by_lower, n=1)
    return f"did you mean {by_lower[close[0]]!r}?" if close else None


def select(tree: _Tree, tip: str | None, joints: Sequence[str] | None, locked: Mapping[str, float] | None) -> Selection:
    """Pick the moving joints of a tree.

    Args:
        tree: the URDF's tree.
        tip: the link at which the chain ends.
        joints: names of the moving joints, in the chain's order.
        locked: positions of joints to lock [rad or m].

    Returns:
        The choice.

    Raises:
        InputError: naming the link or joint that does not exist or does not fit, or listing the choices there are.
    """
    values = _locked_values(tree, locked or {})
    if tip is not None and tip not in tree.links:
        raise InputError(
            f"there is no link {tip!r}", file=tree.file, remedy=nearest(tip, tree.links), kind="unknown_link"
        )
    if joints is not None:
        moving = _by_names(tree, joints, tip, values)
    else:
        moving = _by_tip(tree, tip, values) if tip is not None else _only_one(tree, values)
    follower = next((joint for joint in moving if joint.mimic is not None), None)
    if follower is not None:
        raise InputError(
            f"the joint lies on the chain but mimics {follower.mimic and follower.mimic[0]!r}",
            file=tree.file,
            joint=follower.name,
            allowed="joints that move independently",
            remedy="choose the moving joints by name (--joints), or lock it (--lock)",
        )
    return Selection(moving=moving, tip=tip or _flange(tree, moving), locked=values)


def _locked_values(tree: _Tree, locked: Mapping[str, float]) -> dict[str, float]:
    for name, value in locked.items():
        joint = _known(tree, name)
        if not joint.moves:
            raise InputError("a fixed joint cannot be locked at a position", file=tree.file, joint=name)
        if not math.isfinite(value):
            raise InputError(f"locked at {value}", file=tree.file, joint=name, allowed="a finite position")
        stops = None if joint.limit is None or joint.type == "continuous" else joint.limit.range(joint.kind)
        if stops is None or stops[0] >= stops[1]:
            continue
        # A position beyond the stops is nearly always one in degrees or millimetres.
        if not stops[0] - 1e-6 <= value <= stops[1] + 1e-6:
            allowed = f"{stops[0]:g} to {stops[1]:g} {'m' if joint.kind == 'prismatic' else 'rad'}"
            raise InputError(f"locked at {value:g}, beyond its limits", file=tree.file, joint=name, allowed=allowed)
    return {name: float(value) for name, value in locked.items()}


def _known(tree: _Tree, name: str) -> UrdfJoint:
    if name not in tree.joints:
        raise InputError(
            f"there is no joint {name!r}", file=tree.file, remedy=nearest(name, tree.joints), kind="unknown_joint"
        )
    return tree.joints[name]


def _by_names(tree: _Tree, names: Sequence[str], tip: str | None, locked: Mapping[str, float]) -> tuple[UrdfJoint, ...]:
    if not names:
        raise InputError("the list of moving joints is empty", file=tree.file, allowed="one joint or more")
    moving = tuple(_known(tree, name) for name in names)
    for joint in moving:
        if not joint.moves:
            raise InputError("a fixed joint cannot be selected as a moving joint", file=tree.file, joint=joint.name)
        if joint.name in locked:
            raise InputError("the joint is both moving and locked", file=tree.file, joint=joint.name)
        if list(names).count(joint.name) > 1:
            raise InputError("the joint is named twice", file=tree.file, joint=joint.name)
    end = tip or max((joint.child for joint in moving), key=lambda link: len(tree.path(link)))
    path = [joint.name for joint in tree.path(end)]
    stray = next((name for name in names if name not in path), None)
    if stray is not None:
        raise InputError(
            f"the joint does not lie between the root and link {end!r}",
            file=tree.file,
            joint=stray,
            allowed="joints on one path: " + ", ".join(name for name in path if tree.joints[name].moves),
        )
    ordered = [name for name in path if name in names]
    if ordered != list(names):
        found, order = ", ".join(names), ", ".join(ordered)
        raise InputError(f"the joints are not in the chain's order: {found}", file=tree.file, allowed=order)
    return moving


def _free(joints: Iterable[UrdfJoint], locked: Mapping[str, float]) -> tuple[UrdfJoint, ...]:
    return tuple(joint for joint in joints if joint.moves and joint.name not in locked)


def _by_tip(tree: _Tree, tip: str, locked: Mapping[str, float]) -> tuple[UrdfJoint, ...]:
    moving = _free(tree.path(tip), locked)
    if not moving:
        raise InputError(f"no joint moves between the root and link {tip!r}", file=tree.file)
    return moving


def _only_one(tree: _Tree, locked: Mapping[str, float]) -> tuple[UrdfJoint, ...]:
    choices: dict[tuple[str, ...], str] = {}
    for leaf in tree.leaves:
        names = tuple(joint.name for joint in _free(tree.path(leaf), locked))
        if names:
            choices.setdefault(names, leaf)
    if not choices:
        raise InputError("no joint moves", file=tree.file, allowed="at least one joint that is not fixed or locked")
    # A camera half-way up the arm is no second choice: its joints are the beginning of the arm's.
    whole = [a for a in choices if not any(a == b[: len(a)] for b in choices if a != b)]
    if len(whole) == 1:
        return tuple(tree.joints[name] for name in whole[0])
    lines = [f"{tip}: {', '.join(names)}" for names, tip in choices.items()]
    more = f" and {len(lines) - _LISTED_TIPS} more" if len(lines) > _LISTED_TIPS else ""
    raise InputError(
        f"the {tree.kind} branches into {len(whole)} chains",
        file=tree.file,
        allowed="a tip link of these (tip: joints): " + "; ".join(lines[:_LISTED_TIPS]) + more,
        remedy="choose one by its tip (--tip) or its joints (--joints), or lock joints (--lock)",
        kind="branches",
    )


def _flange(tree: _Tree, moving: Sequence[UrdfJoint]) -> str:
    """The one leaf rigidly attached to the last body, or that body itself where there is none or a choice."""
    last = moving[-1].child
    depth = len(tree.path(last))
    rigid = []
    for leaf in tree.leaves:
        path = tree.path(leaf)
        attached = leaf == last or (len(path) > depth and path[depth].parent == last)
        if attached and not any(joint.moves for joint in path[depth:]):
            rigid.append(leaf)
    return rigid[0] if len(rigid) == 1 else last
