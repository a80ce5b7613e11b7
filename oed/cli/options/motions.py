"""Options of planned motions: where the arm may move, and what the excitation is made of."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from robots.common.errors import InputError
from robots.common.options import numbers

if TYPE_CHECKING:
    from oed.constraints.geometric import GeometricLimit
    from oed.trajectories import Family
    from robots.collision import Surroundings


@dataclass(frozen=True, kw_only=True)
class Obstacles:
    """What the arm must not touch.

    Attributes:
        floor: height of the floor in the base frame [m]. Default: that of the robot file, else the plane that the base
            is mounted on.
        no_floor: there is no floor, as under a robot on a pedestal.
        keep_out: box that the arm must not enter, in the base frame: xmin,xmax,ymin,ymax,zmin,zmax [m]. Repeat for
            more.
    """

    alternatives: ClassVar[tuple[tuple[str, str], ...]] = (("floor", "no_floor"),)

    floor: float | None = None
    no_floor: bool = False
    keep_out: tuple[str, ...] = ()

    def surroundings(self) -> Surroundings:
        """Makes the floor and the boxes.

        Raises:
            InputError: other than six finite numbers, or an empty box.
        """
        import numpy as np

        from robots.collision import Box, Surroundings

        boxes = []
        for number, text in enumerate(self.keep_out, start=1):
            low, high = map(np.array, corners("--keep-out", text))
            if not (np.isfinite(low) & np.isfinite(high) & (low < high)).all():
                raise InputError(f"--keep-out {text}", allowed="finite numbers, each minimum below its maximum")
            pose = np.eye(4)
            pose[:3, 3] = (low + high) / 2.0
            boxes.append(Box(name=f"keep-out {number}", size=high - low, pose=pose))
        floor = False if self.no_floor else True if self.floor is None else self.floor
        return Surroundings(floor=floor, keep_out=tuple(boxes))


@dataclass(frozen=True, kw_only=True)
class Collisions(Obstacles):
    """Whether the arm must not touch anything.

    Attributes:
        collision: avoid collisions with the robot itself, the floor and the obstacles in the robot file. Without it,
            all files say that the motion was not checked.
    """

    collision: bool = True


def corners(option: str, text: str) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Reads the lowest and the highest corner of a box.

    Args:
        option: for the message.
        text: as typed.

    Raises:
        InputError: other than six numbers.
    """
    sides = numbers(option, text)
    if len(sides) != 6:
        allowed = "six numbers xmin,xmax,ymin,ymax,zmin,zmax, such as 0.1,0.6,-0.5,0.5,0.05,inf"
        raise InputError(f"{option} {text}", allowed=allowed)
    return sides[::2], sides[1::2]


@dataclass(frozen=True, kw_only=True)
class Excitation:
    """The optimised part of an experiment.

    Attributes:
        family: family of the optimised part: fourier, bspline, fourier-polynomial, or one of an installed package.
        harmonics: number of harmonics; a B-spline gets as many coefficients per joint.
        base_frequency: frequency of the first harmonic: one over the period [Hz].
    """

    family: str = "fourier"
    harmonics: int = 5
    base_frequency: float = 0.1

    def chosen(self) -> Family:
        """Makes the family.

        Raises:
            InputError: see `oed.trajectories.family`.
        """
        from oed.trajectories import family

        return family(self.family, harmonics=self.harmonics, base_frequency=self.base_frequency)


def tool_limits(tool_box: str | None, singularity: float | None) -> tuple[GeometricLimit, ...]:
    """Makes limits of the flange.

    Args:
        tool_box: six numbers, from and to in x, y and z [m]; None for no box.
        singularity: lower bound of the smallest singular value of the Jacobian; None for no such limit.

    Raises:
        InputError: other than six numbers, an empty box, or a value that is not positive.
    """
    from oed.constraints.singularity import SingularityLimit
    from oed.constraints.tool import ToolBox

    limits: list[GeometricLimit] = []
    if tool_box is not None:
        low, high = corners("--tool-box", tool_box)
        limits.append(ToolBox(lower=(low[0], low[1], low[2]), upper=(high[0], high[1], high[2])))
    if singularity is not None:
        limits.append(SingularityLimit(smallest=singularity))
    return tuple(limits)
