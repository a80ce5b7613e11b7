"""All moving chains of a robot that branches, such as the legs of a quadruped whose base is held."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from robots.assembly import robot_from_urdf
from robots.common.errors import InputError
from robots.common.files import existing_file
from robots.geometry.urdf import UrdfTree, read_urdf
from robots.geometry.urdf_selection import nearest
from robots.geometry.xacro_ import is_description, split_arguments
from robots.loading import catalogue, load_robot
from robots.mujoco_models import is_mjcf, mjcf_tree, robot_from_mjcf
from robots.robot import Robot


def load_branches(
    spec: str | Path | Robot, *, joints: Sequence[str] | None = None, locked: Mapping[str, float] | None = None
) -> tuple[Robot, ...]:
    """Loads the chains of a robot, each as a robot of its own, from a base that is held.

    Args:
        spec: see `load_robot`; a robot is its own only chain.
        joints: the moving joints of all chains, in any order; those that are not named are locked.
        locked: positions of locked joints [rad or m].

    Returns:
        The chains, in the order of the file; together they have every joint that moves, once.

    Raises:
        InputError: see `load_robot`; or a joint that carries several branches and is not locked.
    """
    if isinstance(spec, Robot) or str(spec) in catalogue():
        return (load_robot(spec, joints=joints, locked=locked),)
    described = is_description(str(spec))
    path = existing_file(split_arguments(str(spec))[0] if described else spec)
    if not described and not is_mjcf(path):
        return (load_robot(spec, joints=joints, locked=locked, unlimited=True),)
    tree = read_urdf(Path(str(spec))) if described else mjcf_tree(path, held=True)
    held = {**(locked or {})}
    if joints is not None:
        unknown = next((name for name in joints if name not in tree.joints), None)
        if unknown is not None:
            raise InputError(f"there is no joint {unknown!r}", file=tree.file, remedy=nearest(unknown, tree.joints))
    chains = []
    for names in _branches(tree, held, joints):
        if described:
            robot = robot_from_urdf(Path(str(spec)), None, names, locked, unlimited=True)
        else:
            robot = robot_from_mjcf(path, None, names, locked, unlimited=True, held=True)
        chains.append(replace(robot, stated=str(spec)))
    return tuple(chains)


def _branches(tree: UrdfTree, locked: Mapping[str, float], joints: Sequence[str] | None) -> tuple[tuple[str, ...], ...]:
    """Moving joints of each branch, from the root outwards."""
    paths: list[tuple[str, ...]] = []
    for leaf in tree.leaves:
        names = tuple(
            joint.name
            for joint in tree.path(leaf)
            if joint.moves and joint.name not in locked and (joints is None or joint.name in joints)
            if joint.mimic is None
        )
        if names:
            paths.append(names)
    # A camera half-way up an arm is no branch: its joints are the beginning of the arm's.
    whole = list(dict.fromkeys(a for a in paths if not any(a == b[: len(a)] for b in paths if a != b)))
    if not whole:
        raise InputError("no joint moves", file=tree.file, allowed="at least one joint that is not fixed or locked")
    for index, names in enumerate(whole):
        shared = next((name for name in names for other in whole[:index] if name in other), None)
        if shared is not None:
            raise InputError(
                "it carries several branches",
                file=tree.file,
                joint=shared,
                allowed="branches that a joint of their own moves",
                remedy="lock it (--lock), or choose the joints of one branch (--joints)",
            )
    return tuple(whole)
