"""What an experiment that distinguishes two effects is planned with."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any

from oed.experiments.options import usual_surroundings
from robots.common.errors import InputError
from robots.common.options import Option, Seed, numbers

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from robots.collision import Surroundings
else:  # The options of the command line load without numerical libraries.
    ArrayLike = Any


@dataclass(frozen=True, kw_only=True)
class DiscriminationOptions:
    """What the experiment is planned with.

    Attributes:
        noise: standard deviation of the torque noise (n,) [N m or N]. Default: 2 % of each joint's torque RMS.
        size: of what the effect shows beyond the base model, as a share of the joint's torque RMS in the reference.
        friction: of the base model, ``polynomial`` or ``coulomb-viscous``.
        home: pose (n,) at both ends of all motions. Default: `Limits.home`.
        velocity_fraction: fraction of the velocity limits to use. Default: see `LimitOptions`.
        collision: keep the motions free of collisions, which makes them smaller where they must be, and the home pose
            another one if it is not given and has no room.
        surroundings: the floor, and boxes that the arm must not enter.
        seed: of the reference motion.

    Raises:
        InputError: a size out of range.
    """

    noise: Annotated[ArrayLike | None, Option(reads=numbers)] = None
    size: Annotated[float, Option(hidden=True)] = 0.005
    friction: str = "polynomial"
    home: Annotated[ArrayLike | None, Option(reads=numbers)] = None
    velocity_fraction: float | None = None
    collision: bool = True
    surroundings: Surroundings = field(default_factory=usual_surroundings)
    seed: Seed = 0

    def __post_init__(self) -> None:
        if not 0.0 < self.size <= 1.0:
            raise InputError(f"found the size {self.size}", allowed="above 0, up to 1")
