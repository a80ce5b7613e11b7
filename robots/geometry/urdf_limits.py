"""Limits of a URDF's joint: ``<limit>`` of URDF 1.0 to 1.2 and the soft limits of ``<safety_controller>``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from robots.common.errors import InputError
from robots.geometry.chain import Kind
from robots.geometry.urdf_reader import UrdfReader
from robots.limits import Limits

_ENDLESS = {"revolute": 1e3, "prismatic": 1e4}  # exporters write such numbers, or 1e16, for "no limit"
_MAGNITUDES = ("velocity", "effort", "acceleration", "deceleration", "jerk")


@dataclass(frozen=True, kw_only=True)
class UrdfLimit:
    """The limits that a joint states; None where it states none.

    Exporters write a magnitude of 0, and two equal ends, where they know none: with them nothing could move.

    Attributes:
        lower: lowest position [rad or m].
        upper: highest position.
        velocity: highest speed [rad/s or m/s].
        effort: highest torque or force [N m or N].
        acceleration: highest acceleration [rad/s2 or m/s2] (URDF 1.2).
        deceleration: the same when braking.
        jerk: highest jerk [rad/s3 or m/s3].
        soft_lower: lowest position of the safety controller.
        soft_upper: highest position of the safety controller.
        zeros: names of the magnitudes that are stated as 0.
    """

    lower: float | None = None
    upper: float | None = None
    velocity: float | None = None
    effort: float | None = None
    acceleration: float | None = None
    deceleration: float | None = None
    jerk: float | None = None
    soft_lower: float | None = None
    soft_upper: float | None = None
    zeros: tuple[str, ...] = ()

    def range(self, kind: Kind) -> tuple[float, float] | None:
        """Gives the stops by the specification, in which a missing end is 0.

        Returns:
            Lowest and highest position; None where both are equal or missing, or too far away to be stops.
        """
        low, high = self.lower or 0.0, self.upper or 0.0
        return None if low == high or max(-low, high) >= _ENDLESS[kind] else (low, high)


@dataclass(frozen=True, kw_only=True)
class JointBounds:
    """The bounds of one moving joint in SI units, infinite where there is none, and how they came about.

    Attributes:
        unlimited: whether a joint that has stops states none.
        notes: what is not as a reader may expect, without the joint's name.
    """

    lower: float = -np.inf
    upper: float = np.inf
    velocity: float = np.inf
    acceleration: float = np.inf
    jerk: float = np.inf
    effort: float = np.inf
    unlimited: bool = False
    notes: tuple[str, ...] = ()


def read_limit(joint: ElementTree.Element, read: UrdfReader) -> UrdfLimit | None:
    """Reads ``<limit>`` and ``<safety_controller>``.

    Args:
        joint: the element of the joint.
        read: its reader.

    Returns:
        What is stated; None without ``<limit>``.

    Raises:
        InputError: something else than a number, or a negative magnitude.
    """
    element, soft = read.child(joint, "limit"), read.child(joint, "safety_controller")
    if element is None:
        return None
    stated = {key: read.positive(element, key) for key in _MAGNITUDES}
    return UrdfLimit(
        lower=read.optional(element, "lower"),
        upper=read.optional(element, "upper"),
        soft_lower=read.optional(soft, "soft_lower_limit"),
        soft_upper=read.optional(soft, "soft_upper_limit"),
        **{key: value or None for key, value in stated.items()},
        zeros=tuple(key for key, value in stated.items() if value == 0.0),
    )


def limits_of(bounds: Sequence[JointBounds]) -> Limits:
    """Puts the bounds of the moving joints together."""

    def of(name: str) -> NDArray[np.float64]:
        return np.array([getattr(bound, name) for bound in bounds])

    return Limits(
        lower=of("lower"),
        upper=of("upper"),
        velocity=of("velocity"),
        acceleration=of("acceleration"),
        jerk=of("jerk"),
        torque=of("effort"),
    )


def joint_bounds(limit: UrdfLimit | None, type_: str, *, name: str, file: str) -> JointBounds:
    """Works out the bounds that a moving joint keeps.

    The smaller one of acceleration and deceleration counts, and the tighter one of the stops and the soft limits.

    Args:
        limit: what the joint states.
        type_: ``revolute``, ``continuous`` or ``prismatic``.
        name: of the joint, for messages.
        file: for messages.

    Raises:
        InputError: ends in the wrong order.
    """
    if limit is None:
        return JointBounds(unlimited=type_ != "continuous")
    kind: Kind = "prismatic" if type_ == "prismatic" else "revolute"
    lower, upper = -np.inf, np.inf
    notes: list[str] = []
    if type_ != "continuous":
        lower, upper, notes = _ends(limit, kind, name, file)
    if limit.zeros:
        notes.append(f"<limit> has {' and '.join(limit.zeros)} 0, which stands for unknown")
    acceleration = min((a for a in (limit.acceleration, limit.deceleration) if a is not None), default=np.inf)
    if limit.acceleration is not None and limit.deceleration is not None and limit.acceleration != limit.deceleration:
        smaller = "deceleration" if limit.deceleration < limit.acceleration else "acceleration"
        notes.append(f"acceleration and deceleration limits differ; the {smaller} ({acceleration:g}) counts for both")
    notes += _wrong_units(limit, kind)
    return JointBounds(
        lower=lower,
        upper=upper,
        velocity=_or_infinite(limit.velocity),
        acceleration=acceleration,
        jerk=_or_infinite(limit.jerk),
        effort=_or_infinite(limit.effort),
        unlimited=type_ != "continuous" and not np.isfinite([lower, upper]).all(),
        notes=tuple(notes),
    )


def _ends(limit: UrdfLimit, kind: Kind, name: str, file: str) -> tuple[float, float, list[str]]:
    lower, upper, notes = -np.inf, np.inf, []
    stops = limit.range(kind)
    if stops is not None:
        lower, upper = stops
        if lower >= upper:
            problem = f"<limit> has lower {lower:g} and upper {upper:g}"
            raise InputError(problem, file=file, joint=name, allowed="lower below upper")
        for key, value in (("lower", limit.lower), ("upper", limit.upper)):
            if value is None:
                notes.append(f"<limit> states no {key}; it is 0 by the URDF specification")
    elif limit.lower is not None and limit.lower == limit.upper != 0.0:
        notes.append(f"<limit> has lower and upper {limit.lower:g}, which stands for unknown")
    soft = limit.soft_lower, limit.soft_upper
    if any(soft):
        tight = max(lower, -np.inf if soft[0] is None else soft[0]), min(upper, np.inf if soft[1] is None else soft[1])
        if tight[0] >= tight[1]:
            problem = f"the soft limits of <safety_controller> leave no range: {tight[0]:g} to {tight[1]:g}"
            raise InputError(problem, file=file, joint=name, allowed="soft_lower_limit below soft_upper_limit")
        if tight != (lower, upper):
            unit = "m" if kind == "prismatic" else "rad"
            notes.append(f"soft limits of <safety_controller> are used: {tight[0]:g} to {tight[1]:g} {unit}")
        lower, upper = tight
    return lower, upper, notes


def _wrong_units(limit: UrdfLimit, kind: Kind) -> list[str]:
    """What looks like degrees or millimetres."""
    linear = kind == "prismatic"
    # No arm turns a joint three times around, or at eight turns per second; in degrees both are common.
    far, fast = (30.0, 20.0) if linear else (20.0, 50.0)
    unit, meant = ("m", "millimetres") if linear else ("rad", "degrees")
    notes = []
    ends = max(abs(value) for value in limit.range(kind) or (0.0,))
    if ends > far:
        notes.append(f"position limits up to {ends:g} {unit} look like {meant}")
    if limit.velocity is not None and fast < limit.velocity < np.inf:
        notes.append(f"a velocity limit of {limit.velocity:g} {unit}/s looks like {meant} per second")
    return notes


def _or_infinite(value: float | None) -> float:
    return np.inf if value is None else value
