"""Options of planned motions: where the arm may move, and what the excitation is made of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar

from robots.common.options import Option, box

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
    keep_out: Annotated[tuple[tuple[float, ...], ...], Option(reads=box, several=True)] = ()

    def surroundings(self) -> Surroundings:
        """Makes the floor and the boxes.

        Raises:
            InputError: numbers that are not finite, or an empty box.
        """
        from robots.collision import Surroundings

        floor = False if self.no_floor else True if self.floor is None else self.floor
        return Surroundings.between(floor, self.keep_out)


@dataclass(frozen=True, kw_only=True)
class Collisions(Obstacles):
    """Whether the arm must not touch anything.

    Attributes:
        collision: avoid collisions with the robot itself, the floor and the obstacles in the robot file. Without it,
            all files say that the motion was not checked.
    """

    collision: bool = True


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


def tool_limits(tool_box: Sequence[float] | None, singularity: float | None) -> tuple[GeometricLimit, ...]:
    """Makes limits of the flange.

    Args:
        tool_box: from and to in x, y and z [m]; None for no box.
        singularity: lower bound of the smallest singular value of the Jacobian; None for no such limit.

    Raises:
        InputError: an empty box, or a value that is not positive.
    """
    from oed.constraints.singularity import SingularityLimit
    from oed.constraints.tool import ToolBox

    limits: list[GeometricLimit] = []
    if tool_box is not None:
        x, x2, y, y2, z, z2 = tool_box
        limits.append(ToolBox(lower=(x, y, z), upper=(x2, y2, z2)))
    if singularity is not None:
        limits.append(SingularityLimit(smallest=singularity))
    return tuple(limits)
