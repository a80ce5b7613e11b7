"""The tree of links that a URDF describes, and the serial chain a user picks from it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.geometry.chain import Chain, Joint, LinkPlace, joint_motion
from robots.geometry.inertia import BODY_PARAMETERS, body_doubts, check_body, inertial_parameters
from robots.geometry.urdf_limits import JointBounds, joint_bounds, limits_of
from robots.geometry.urdf_selection import Selection, nearest, select
from robots.geometry.urdf_xml import UrdfElements, UrdfJoint, UrdfLink, read_elements
from robots.limits import Limits


class UrdfChain(NamedTuple):
    """A chain taken from a URDF: ``inertia`` is (n, 10) about the link frames, everything locked lumped in.

    A row of NaN is unknown: no link of that body states a mass.

    ``unlimited`` names the joints that have stops but state none. ``notes`` says what a reader may not expect.
    ``links`` has all links of the file with the body that carries each.
    """

    chain: Chain
    limits: Limits
    inertia: Array
    names: tuple[str, ...]
    unlimited: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    links: tuple[LinkPlace, ...] = ()


class UrdfTree:
    """Links and joints of a URDF that hang together as one tree.

    Args:
        elements: what the file states.
        kind: of the file, for messages.

    Raises:
        InputError: naming the link or joint, when they do not form one tree.
    """

    def __init__(self, elements: UrdfElements, kind: str = "URDF") -> None:
        self.file = elements.file
        self.kind = kind
        self.name = elements.name
        self.digest = elements.digest
        self.unused = elements.unused
        self.links: dict[str, UrdfLink] = {link.name: link for link in elements.links}
        self.joints: dict[str, UrdfJoint] = {joint.name: joint for joint in elements.joints}
        if not self.joints:
            raise InputError(f"the {self.kind} has no joint", file=self.file)
        self._declare_world()
        self.parent_joint: dict[str, UrdfJoint] = {}
        self.child_joints: dict[str, list[UrdfJoint]] = {name: [] for name in self.links}
        for joint in self.joints.values():
            self._attach(joint)
        self.root = self._find_root()

    def _declare_world(self) -> None:
        # Simulators accept a "world" that is nowhere declared, so exported files leave it out.
        used, given = {joint.parent for joint in self.joints.values()}, {joint.child for joint in self.joints.values()}
        if "world" in used - given - set(self.links):
            self.links["world"] = UrdfLink(name="world")

    def _attach(self, joint: UrdfJoint) -> None:
        for role, name in (("parent", joint.parent), ("child", joint.child)):
            if name not in self.links:
                problem = f"the {role} link {name!r} does not exist"
                raise InputError(problem, file=self.file, joint=joint.name, remedy=nearest(name, self.links))
        first = self.parent_joint.get(joint.child)
        if first is not None:
            raise InputError(
                f"link {joint.child!r} has two parents, by the joints {first.name!r} and {joint.name!r}",
                file=self.file,
                remedy="cut the loop: only trees of links are supported",
            )
        self.parent_joint[joint.child] = joint
        self.child_joints[joint.parent].append(joint)

    def _find_root(self) -> str:
        roots = [name for name in self.links if name not in self.parent_joint]
        if len(roots) > 1:
            listed = ", ".join(repr(name) for name in roots)
            raise InputError(f"{len(roots)} links have no parent: {listed}", file=self.file, allowed="one root link")
        reached = set(roots)
        stack = list(roots)
        while stack:
            children = [joint.child for joint in self.child_joints[stack.pop()]]
            reached.update(children)
            stack.extend(children)
        lost = next((name for name in self.links if name not in reached), None)
        if lost is not None:
            raise InputError(f"link {lost!r} is part of a loop without a root link", file=self.file)
        return roots[0]

    def path(self, link: str) -> tuple[UrdfJoint, ...]:
        """Joints from the root to a link, fixed ones included.

        Args:
            link: the name of a link.

        Returns:
            The joints in order; empty for the root.
        """
        joints = []
        while link != self.root:
            joint = self.parent_joint[link]
            joints.append(joint)
            link = joint.parent
        return tuple(reversed(joints))

    @cached_property
    def leaves(self) -> tuple[str, ...]:
        """Links without children, in the order of the file."""
        return tuple(name for name, joints in self.child_joints.items() if not joints)

    def chain(
        self,
        tip: str | None = None,
        joints: Sequence[str] | None = None,
        locked: Mapping[str, float] | None = None,
    ) -> UrdfChain:
        """Take a serial chain out of the tree; every other joint is locked and its links' inertia lumped in.

        Args:
            tip: the link at which the chain ends; also the flange.
            joints: the moving joints, in the chain's order; those between that are not named are locked.
            locked: positions of locked joints [rad or m]; its `rest` where not stated. A joint that mimics another one
                follows that one's locked position.

        Returns:
            The chain, its limits (infinite where the file states none), and the inertial parameters of its n bodies
            about their link frames. Gravity is along -z of the root link.

        Raises:
            InputError: naming the joint or link; and when several chains are possible, listing them.
        """
        selection = select(self, tip, joints, locked)
        moving = {joint.name: i for i, joint in enumerate(selection.moving)}
        chain_joints: list[Joint] = []
        inertia = np.full((len(moving), BODY_PARAMETERS), np.nan)
        lumped: list[list[str]] = [[] for _ in moving]
        places: list[LinkPlace] = []
        held: list[str] = []
        flange: Array = np.eye(4)
        stack: list[tuple[str, int, Array]] = [(self.root, -1, np.eye(4))]
        while stack:
            name, body, pose = stack.pop()
            places.append(LinkPlace(name, body + 1, pose))
            if body >= 0:
                # Only what moves: bodies of the base without a proper inertia are common, and do no harm.
                own = self._parameters(self.links[name], pose)
                inertia[body] = np.where(np.isnan(inertia[body]), own, inertia[body] + np.nan_to_num(own))
                lumped[body].append(name)
            if name == selection.tip:
                flange = pose
            for joint in self.child_joints[name]:
                placement = pose @ joint.placement
                if joint.name in moving:
                    body_joint = Joint(joint.name, joint.kind, placement[:3, :3], placement[:3, 3], joint.axis)
                    chain_joints.append(body_joint)
                    stack.append((joint.child, moving[joint.name], np.eye(4)))
                else:
                    stack.append((joint.child, body, placement @ self._locked_motion(joint, selection)))
                    stated = joint.name in selection.locked or joint.mimic is not None
                    if joint.moves and body >= 0 and not stated and self.links[joint.child].mass > 0:
                        held.append(joint.name)
        for i in np.flatnonzero(inertia[:, 0] == 0.0):
            raise InputError(
                f"the body it moves has no mass: the next joint is of the same {self.kind} body",
                file=self.file,
                joint=selection.moving[i].name,
                remedy="put it into a body of its own, with a small mass, or lock the joint (--lock)",
            )
        inertia.flags.writeable = False
        chain_joints.sort(key=lambda joint: moving[joint.name])
        chain = Chain(tuple(chain_joints), tip=flange)
        bounds = [self._bounds(joint) for joint in selection.moving]
        unlimited = tuple(name for name, bound in zip(chain.names, bounds, strict=True) if bound.unlimited)
        notes = [
            *self._limit_notes(chain.names, bounds),
            *self._body_notes(chain, lumped),
            *self._held_notes(held),
            *(
                f"joint {joint.name} mimics {'the moving joint' if joint.mimic[0] in moving else 'the unknown joint'} "
                f"{joint.mimic[0]}; it is treated as locked"
                for joint in self.joints.values()
                if joint.mimic is not None and joint.name not in selection.locked
                if joint.mimic[0] in moving or joint.mimic[0] not in self.joints
            ),
        ]
        return UrdfChain(chain, limits_of(bounds), inertia, chain.names, unlimited, tuple(notes), tuple(places))

    def _parameters(self, link: UrdfLink, pose: Array) -> Array:
        """Inertial parameters (10,) about the body's frame; NaN where the link states no mass."""
        if np.isnan(link.mass):
            return np.full(BODY_PARAMETERS, np.nan)
        check_body(link.mass, link.inertia_at_com, f"link {link.name!r}", file=self.file)
        return inertial_parameters(link.mass, link.com, link.inertia_at_com, pose)

    def _locked_motion(self, joint: UrdfJoint, selection: Selection) -> Array:
        if not joint.moves:
            return np.eye(4)
        return joint_motion(joint.kind, joint.axis, self._locked_value(joint, selection, ()))

    def _locked_value(self, joint: UrdfJoint, selection: Selection, seen: tuple[str, ...]) -> float:
        if joint.name in selection.locked:
            return selection.locked[joint.name]
        if joint.mimic is None:
            return joint.rest
        leader, multiplier, offset = joint.mimic
        if leader in seen or leader == joint.name:
            raise InputError("it mimics itself, directly or through other joints", file=self.file, joint=joint.name)
        if leader not in self.joints or any(leader == moving.name for moving in selection.moving):
            return offset
        return multiplier * self._locked_value(self.joints[leader], selection, (*seen, joint.name)) + offset

    def _bounds(self, joint: UrdfJoint) -> JointBounds:
        return joint_bounds(joint.limit, joint.type, name=joint.name, file=self.file)

    def _limit_notes(self, names: Sequence[str], bounds: Sequence[JointBounds]) -> list[str]:
        """One note for all joints that share it."""
        shared: dict[str, list[str]] = {}
        for name, bound in zip(names, bounds, strict=True):
            for note in bound.notes:
                shared.setdefault(note, []).append(name)
        return [
            f"{'joints' if len(named) > 1 else 'joint'} {', '.join(named)}: {note}" for note, named in shared.items()
        ]

    def _held_notes(self, names: Sequence[str]) -> list[str]:
        """One note for all joints whose links move as a part of the chain without a word of the user."""
        if not names:
            return []
        joints = f"joint {names[0]} is" if len(names) == 1 else f"joints {', '.join(sorted(names))} are"
        return [f"{joints} no part of the chain: held at rest, their links count with those that carry them (--lock)"]

    def _body_notes(self, chain: Chain, lumped: Sequence[Sequence[str]]) -> list[str]:
        size = sum(float(np.linalg.norm(joint.translation)) for joint in chain.joints)
        size += float(np.linalg.norm(chain.tip[:3, 3]))
        links = [self.links[name] for names in lumped for name in names]
        massless = [link.name for link in links if np.isnan(link.mass) and link.inertia_at_com.any()]
        notes = []
        if massless:
            has = "link {} has" if len(massless) == 1 else "links {} have"
            notes.append(f"{has.format(', '.join(massless))} an inertia but no mass: it is not used")
        masses = [link.mass for link in links if link.mass > 0]
        # Links of equal mass are common in pendulums of up to three links, and in no arm.
        if len(masses) > 3 and len(set(masses)) == 1:
            notes.append(f"all {len(masses)} links with a mass have {masses[0]:g} kg: it may stand for unknown masses")
        return notes + [
            f"link {link.name} has {doubt}"
            for link in links
            for doubt in body_doubts(link.mass, link.com, link.inertia_at_com, size)
        ]

    def friction(self, names: Sequence[str]) -> Array:
        """Friction as the file's ``<dynamics friction= damping=>`` states it.

        Args:
            names: the joints.

        Returns:
            (n, 4) coefficients f1..f4, of which a URDF states f1 [N m] and f2 [N m s/rad]; 0 where it states none.
        """
        return np.array([[self.joints[name].friction, self.joints[name].damping, 0.0, 0.0] for name in names])


def read_urdf(path: str | Path) -> UrdfTree:
    """Read a URDF file.

    Args:
        path: the file, a ``.urdf`` or a ``.xacro``.

    Returns:
        Its tree of links; ``tree.chain(...)`` takes the robot's chain out of it.

    Raises:
        InputError: naming the file and the line, link or joint at fault.
    """
    return UrdfTree(read_elements(path))
