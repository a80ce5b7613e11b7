"""What a robot's description leaves open, or states in vain: the notes of its robot."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.geometry.chain import Kind
from robots.geometry.urdf import UrdfChain
from robots.limits import ACCELERATION_PER_VELOCITY, JERK_PER_ACCELERATION, Limits
from robots.robot import MASSES_REMEDY


def require_stops(names: Sequence[str], accepted: bool, file: str | Path) -> None:
    """Refuses joints with stops whose positions are not stated.

    Args:
        names: of these joints.
        accepted: whether they may be unlimited.
        file: that they are in.

    Raises:
        InputError: naming them.
    """
    if names and not accepted:
        others = f" (nor do {', '.join(names[1:])})" if len(names) > 1 else ""
        raise InputError(
            f"<limit> states no position limits{others}: without lower and upper, or with equal ones, "
            "there is no range",
            file=file,
            joint=names[0],
            allowed="lower below upper",
            remedy="state them there or under limits.position of a robot YAML, make the joint continuous, lock it "
            "(--lock), or accept unlimited positions (--unlimited; in Python unlimited=True)",
        )


def urdf_notes(taken: UrdfChain, unused: Sequence[str]) -> tuple[str, ...]:
    """Lists what a reader of the URDF may not expect.

    Args:
        taken: the chain.
        unused: elements and attributes that are not read.

    Returns:
        One sentence each.
    """
    notes = list(taken.notes)
    reach = sum(float(np.linalg.norm(joint.translation)) for joint in taken.chain.joints[1:])
    # Sum of the distances between joints that no arm has [m].
    if reach > 50.0:
        notes.append(f"the distances between its joints add up to {reach:.3g} m: they may be in millimetres")
    if taken.unlimited:
        word = "joint" if len(taken.unlimited) == 1 else "joints"
        notes.append(f"{word} {', '.join(taken.unlimited)}: no position limits stated; positions are unlimited")
    if unused:
        notes.append(f"not used from the URDF: {'; '.join(unused)}")
    return tuple(notes)


def assumed_in_urdf(taken: UrdfChain, friction: Array, root: str) -> tuple[str, ...]:
    """Lists what a URDF does not state and what is taken instead, in one sentence.

    Args:
        taken: the chain.
        friction: (n, 4) as the file states it.
        root: name of the root link.

    Returns:
        The sentence, alone in a tuple.
    """
    parts = assumed_limits(taken.limits, taken.chain.kinds)
    parts += lacking("velocity limits", ~np.isfinite(taken.limits.velocity), taken.names)
    parts += lacking("torque limits", ~np.isfinite(taken.limits.torque), taken.names)
    parts += lacking("friction", ~friction.any(axis=1), taken.names)
    parts += ["no rotor inertia", "a controller period of 4 ms", f"gravity 9.81 m/s2 along -z of link {root}"]
    return (f"assumed, because the URDF does not state it: {', '.join(parts)}",)


def lacking(quantity: str, where: ArrayLike, names: Sequence[str]) -> list[str]:
    """Says which joints lack a quantity, in a few words; nothing where all have it.

    Args:
        quantity: in words.
        where: the joints that lack it (n,).
        names: of the joints.
    """
    without = [name for name, lacks in zip(names, np.asarray(where), strict=True) if lacks]
    if not without:
        return []
    return [f"no {quantity}" if len(without) == len(names) else f"no {quantity} at {', '.join(without)}"]


def unknown_masses(inertia: Array, names: Sequence[str]) -> tuple[str, ...]:
    """Names the links whose masses are not known, in one sentence alone in a tuple.

    Args:
        inertia: (n, 10), a row of NaN where unknown.
        names: of the joints.
    """
    joints = [name for name, row in zip(names, inertia, strict=True) if np.isnan(row).any()]
    if not joints:
        return ()
    which = "all links" if len(joints) == len(names) else f"the links that {', '.join(joints)} move"
    return (
        f"the masses of {which} are not stated, so they are unknown; design, check, identify, payload and diagnose "
        f"need none. Simulation and torque limits need them: {MASSES_REMEDY}",
    )


def assumed_limits(limits: Limits, kinds: Sequence[Kind]) -> list[str]:
    """Lists the limits that planned motions keep where none are stated: they follow from the speed limits.

    Args:
        limits: as stated.
        kinds: of the joints (n).

    Returns:
        A few words for accelerations, and for jerks; nothing of joints without a speed limit.
    """
    acceleration = np.where(
        np.isfinite(limits.acceleration), limits.acceleration, ACCELERATION_PER_VELOCITY * limits.velocity
    )
    jerk = JERK_PER_ACCELERATION * acceleration
    parts = []
    if (wanted := ~np.isfinite(limits.acceleration) & np.isfinite(acceleration)).any():
        values = _values(acceleration, wanted, kinds, "s2")
        parts.append(f"acceleration limits {values} (full speed in {1 / ACCELERATION_PER_VELOCITY:g} s)")
    if (wanted := ~np.isfinite(limits.jerk) & np.isfinite(jerk)).any():
        values = _values(jerk, wanted, kinds, "s3")
        parts.append(f"jerk limits {values} (full acceleration in {1 / JERK_PER_ACCELERATION:g} s)")
    return parts


def _values(values: Array, wanted: NDArray[np.bool_], kinds: Sequence[Kind], rate: str) -> str:
    """Values of the wanted joints with their units; one for all where they are equal."""
    texts = [
        f"{value:.3g} {'m' if kind == 'prismatic' else 'rad'}/{rate}"
        for value, kind, asked in zip(values, kinds, wanted, strict=True)
        if asked
    ]
    if len(set(texts)) == 1:
        return texts[0]
    unit = texts[0].partition(" ")[2]
    same = all(text.partition(" ")[2] == unit for text in texts)
    return f"{', '.join(text.partition(' ')[0] for text in texts)} {unit}" if same else ", ".join(texts)
