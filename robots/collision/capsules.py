"""Capsules: all points within a radius of a line segment, the shape that encloses a link."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.description import CapsuleDescription
from robots.geometry.chain import Chain


def frozen_vector(value: ArrayLike, what: str) -> Array:
    """Checks a vector of three finite numbers and returns it read-only.

    Raises:
        InputError: another shape, or a number that is not finite.
    """
    try:
        vector = np.array(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{what} is not numeric", allowed="three numbers") from error
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise InputError(f"{what} is {vector}", allowed="three finite numbers")
    vector.flags.writeable = False
    return vector


@dataclass(frozen=True, kw_only=True, eq=False)
class Capsule:
    """All points within `radius` of the segment from `start` to `end`, the spine.

    Args:
        name: what people call it.
        link: the link that carries it: 0 the base, i the link that joint i moves.
        start: (3,) in the link's frame, which is the joint's frame moved by q, or in the base frame [m].
        end: (3,) likewise; equal to `start` for a sphere.
        radius: [m].
        source: where it comes from, as in a robot's file.

    Raises:
        InputError: naming the capsule, on a radius or a link that is not possible.
    """

    name: str
    link: int
    start: Array
    end: Array
    radius: float
    source: str | None = None

    def __post_init__(self) -> None:
        for key in ("start", "end"):
            object.__setattr__(self, key, frozen_vector(getattr(self, key), f"{self.name}: {key}"))
        if not (np.isfinite(self.radius) and self.radius > 0.0):
            raise InputError(f"{self.name}: a radius of {self.radius} m", allowed="a positive length")
        if self.link < 0:
            raise InputError(f"{self.name}: on link {self.link}", allowed="0 for the base, or a link from 1")

    @property
    def is_sphere(self) -> bool:
        """Whether the spine is a point."""
        return bool(np.array_equal(self.start, self.end))


def reach(chain: Chain) -> float:
    """Adds up the lengths from the first joint to the flange: no point of the flange is ever farther away [m].

    Prismatic joints count as they stand at zero.
    """
    lengths = [float(np.linalg.norm(joint.translation)) for joint in chain.joints[1:]]
    return sum(lengths) + float(np.linalg.norm(chain.tip[:3, 3]))


def stated_capsules(descriptions: Iterable[CapsuleDescription], chain: Chain) -> tuple[Capsule, ...]:
    """Makes the capsules that a robot's file states.

    Args:
        descriptions: the entries under ``collision.links``.
        chain: the robot's chain.

    Raises:
        InputError: a capsule on a link that the chain has not, or two of one name.
    """
    capsules = []
    for index, entry in enumerate(descriptions, start=1):
        if entry.link > chain.n:
            problem, allowed = f"a capsule on link {entry.link}", f"0 (the base) to {chain.n}"
            raise InputError(problem, column=f"collision.links[{index}].link", allowed=allowed)
        capsules.append(
            Capsule(
                name=entry.name or link_name(entry.link),
                link=entry.link,
                start=np.array(entry.start),
                end=np.array(entry.end),
                radius=entry.radius,
                source=entry.source,
            )
        )
    return numbered(capsules)


def has_extent(chain: Chain) -> bool:
    """Whether the joints and the flange of a chain are apart, so that its links have a length."""
    return bool(reach(chain) or np.linalg.norm(chain.joints[0].translation))


def segment_capsules(chain: Chain, fraction: float) -> tuple[Capsule, ...]:
    """Lays a capsule along each link, from its joint's origin to the next one's, for robots that state none.

    Args:
        chain: the chain.
        fraction: radius as a share of the arm's `reach`; of the sum of all lengths where that is zero.

    Raises:
        InputError: a fraction that is not positive, or an arm of no extent at all.
    """
    base_length = float(np.linalg.norm(chain.joints[0].translation))
    size = reach(chain) or base_length
    if not (np.isfinite(fraction) and 0.0 < fraction < 1.0):
        raise InputError(f"a radius of {fraction} times the reach", allowed="more than 0 and less than 1")
    if size == 0.0:
        raise InputError(
            "the chain has no extent, so its links have no size", remedy="state the links' capsules under 'collision'"
        )
    ends = [joint.translation for joint in chain.joints] + [chain.tip[:3, 3]]
    return tuple(
        Capsule(name=link_name(i), link=i, start=np.zeros(3), end=end, radius=fraction * size, source="assumed")
        for i, end in enumerate(ends)
    )


def link_name(link: int) -> str:
    """Names a link for people."""
    return f"link {link}" if link else "base"


def numbered(capsules: list[Capsule]) -> tuple[Capsule, ...]:
    """Numbers capsules that share a name, so that a message names one of them.

    Args:
        capsules: in any order.
    """
    shared, seen = Counter(capsule.name for capsule in capsules), Counter[str]()
    named = []
    for capsule in capsules:
        seen[capsule.name] += 1
        number = f" ({seen[capsule.name]})" if shared[capsule.name] > 1 else ""
        named.append(replace(capsule, name=capsule.name + number) if number else capsule)
    return tuple(named)
