"""Choices for the loop of experiments."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

from oed.experiments.options import usual_surroundings
from robots.common.errors import InputError
from robots.common.options import Seed

if TYPE_CHECKING:
    from robots.collision import CollisionModel, Surroundings
    from robots.robot import Robot


@dataclass(frozen=True, kw_only=True)
class LoopOptions:
    """What the loop does.

    Attributes:
        experiments: number of experiments at most, the first one included.
        least_probability: an experiment that separates the causes with less probability is not made.
        longest: repetitions beyond this time of an experiment are left to the next one [s].
        friction: friction model: auto (bends within the recorded speeds, grows linearly beyond), polynomial
            (four coefficients a joint) or coulomb-viscous (two).
        velocity_fraction: fraction of the velocity limits to use. Default: 1 for robots of the catalogue, 0.5 for
            others, whose first motion should be slower.
        effort: effort of the design: quick, standard or thorough.
        collision: avoid collisions with the robot itself, the floor and the obstacles in the robot file. Without it,
            all files say that the motion was not checked.
        surroundings: the floor, and boxes that the arm must not enter.
        seed: seed of the random numbers.

    Raises:
        InputError: a number out of range.
    """

    experiments: int = 4
    least_probability: float = 0.5
    longest: float = 600.0
    friction: str = "auto"
    velocity_fraction: float | None = None
    effort: str = "standard"
    collision: bool = True
    surroundings: Surroundings = field(default_factory=usual_surroundings)
    seed: Seed = 0

    def __post_init__(self) -> None:
        if self.experiments != int(self.experiments) or self.experiments < 1:
            raise InputError(f"{self.experiments} experiments", allowed="a whole number, at least 1")
        if not 0.0 <= self.least_probability <= 1.0:
            raise InputError(f"a least probability of {self.least_probability}", allowed="0 to 1")
        if not self.longest > 0.0:
            raise InputError(f"experiments of at most {self.longest} s", allowed="above 0")
        if self.velocity_fraction is not None and not 0.0 < self.velocity_fraction <= 1.0:
            raise InputError(f"a velocity fraction of {self.velocity_fraction}", allowed="above 0, up to 1")

    def bodies(self, robot: Robot) -> CollisionModel | None:
        """Makes the bodies and obstacles that have to stay apart; None where nothing has to.

        Args:
            robot: the robot.
        """
        bodies = self.surroundings.model(robot) if self.collision else None
        return bodies if bodies is not None and bodies.pairs else None

    def settings(self) -> dict[str, Any]:
        """Writes what must stay the same when the loop goes on as plain data."""
        data = asdict(self) | self.surroundings.settings()
        del data["surroundings"]
        # The budget may be raised later.
        del data["experiments"], data["least_probability"], data["longest"]
        return data
