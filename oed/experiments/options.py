"""What can be chosen of a design, in five groups; the defaults are a good experiment for any robot."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Annotated, Any

from robots.common.errors import InputError
from robots.common.options import Option, Seed, numbers
from robots.common.plain import finite

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from numpy.typing import ArrayLike

    from oed.constraints import StateLimit
    from oed.constraints.geometric import GeometricLimit
    from oed.criteria import Prior
    from oed.experiments.searches.search import Effort
    from oed.experiments.solvers import Solver
    from oed.trajectories import Family
    from robots.collision import CollisionModel, Surroundings
    from robots.plants import PlantEffect
    from robots.robot import Robot
    from robots.signals import Motion
    from robots.terms import FrictionTerm
else:  # The options of the command line load without what only Python can give.
    ArrayLike = Effort = Family = FrictionTerm = Any


def _fourier() -> Family:
    from oed.trajectories import Fourier

    return Fourier()


def usual_surroundings() -> Surroundings:
    """Makes the floor of the robot's description, and no boxes."""
    from robots.collision import Surroundings

    return Surroundings()


def _interior_point() -> Solver:
    from oed.experiments.solvers import InteriorPoint

    return InteriorPoint()


@dataclass(frozen=True, kw_only=True)
class ModelOptions:
    """Which model will be fitted to the experiment. The friction may be a term of one's own.

    Attributes:
        friction: friction model: polynomial (four coefficients a joint), coulomb-viscous (two), or the name of another
            friction term.
        offset: include a constant torque offset per joint in the model.
        rotor: include rotor inertias in the model.
        essential: leave out parameters that contribute less than this fraction of each joint's torque, by the robot's
            description on random motions; 0 keeps all.
        velocity_scale: of the Coulomb column tanh(dq / scale) [rad/s].
        payload_only: design the motion that determines a payload: the arm counts as known, as in the difference of two
            logs of one path. `oed design` then has the criterion d and no strokes by default.
    """

    friction: str | FrictionTerm = "polynomial"
    offset: bool = False
    rotor: Annotated[bool, Option(hidden=True)] = True
    essential: float = 0.0
    velocity_scale: Annotated[float, Option(hidden=True)] = 0.02
    payload_only: bool = False

    def settings(self) -> dict[str, Any]:
        """Writes them as plain data; a term of one's own by its name."""
        friction = self.friction if isinstance(self.friction, str) else self.friction.name
        return {
            "friction": friction,
            "offset": self.offset,
            "rotor": self.rotor,
            "essential": self.essential,
            "velocity_scale": self.velocity_scale,
            "payload_only": self.payload_only,
        }


@dataclass(frozen=True, kw_only=True)
class TrajectoryOptions:
    """What the experiment consists of.

    Attributes:
        family: of the optimised part: `Fourier`, `BSpline`, `FourierPolynomial`, one of one's own, or a name.
        periods: repetitions of the optimised part.
        strokes: add one velocity stroke per joint: to the velocity limit, forwards and backwards.
        home: pose (n,) at start and end [rad or m], comma-separated. Default: zero, or the nearest pose free of
            collisions.

    Raises:
        InputError: an unknown or unusable family, or a number of periods out of range.
    """

    family: Annotated[str | Family, Option(hidden=True)] = field(default_factory=_fourier)
    periods: int = 3
    strokes: bool = True
    home: Annotated[ArrayLike | None, Option(reads=numbers, section="Robot")] = None

    def __post_init__(self) -> None:
        from oed.trajectories import check_family
        from oed.trajectories import family as choose_family

        chosen = choose_family(self.family)
        check_family(chosen)
        object.__setattr__(self, "family", chosen)
        _whole("periods", self.periods, 1)

    @property
    def excitation(self) -> Family:
        """The family of the optimised part."""
        return self.family  # type: ignore[return-value]

    def settings(self) -> dict[str, Any]:
        """Writes them as plain data."""
        family = self.excitation.settings()
        fourier = {key: value for key, value in family.items() if key != "name"} if family["name"] == "fourier" else {}
        return {
            "family": family,
            **fourier,
            "periods": self.periods,
            "strokes": self.strokes,
            "home": _numbers(self.home),
        }


@dataclass(frozen=True, kw_only=True)
class LimitOptions:
    """Which limits the whole experiment keeps, besides position, acceleration and jerk.

    Attributes:
        velocity_fraction: fraction of the velocity limits to use. Default: 1 for robots of the catalogue, 0.5 for
            others, whose first motion should be slower.
        torque: respect the torque limits, computed with the robot's nominal dynamics, if its description has both.
        torque_margin: fraction of the torque limits to keep as reserve for what the nominal dynamics are wrong by.
        collision: avoid collisions with the robot itself, the floor and the obstacles in the robot file; the whole
            experiment is proved free. Without it, all files say that the motion was not checked.
        clearance: minimum clearance of bodies and obstacles [m].
        surroundings: the floor, and boxes that the arm must not enter.
        space: limits in space, such as `ToolBox`, `PlaneLimit` and `SingularityLimit`, or one of one's own.
        motion: limits of position, velocity and acceleration of one's own, see `StateLimit`.
        effects: what the robot has beyond its description, as a diagnosis found it: the torque of those that follow
            from position, velocity and acceleration counts within the torque limits.
        payload: ten inertial parameters (10,) of a body that the robot carries on its flange, in the flange's frame:
            its torque counts within the torque limits.

    Raises:
        InputError: a velocity fraction out of range, or a payload of another shape.
    """

    velocity_fraction: float | None = None
    torque: bool = True
    torque_margin: float = 0.1
    collision: bool = True
    clearance: float = 0.01
    surroundings: Surroundings = field(default_factory=usual_surroundings)
    space: Sequence[GeometricLimit] = ()
    motion: Sequence[StateLimit] = ()
    effects: Sequence[PlantEffect] = ()
    payload: Annotated[ArrayLike | None, Option(hidden=True)] = None

    def __post_init__(self) -> None:
        from oed.constraints import StateLimit
        from oed.constraints.geometric import GeometricLimit
        from robots.signal_checks import checked_body

        if self.velocity_fraction is not None and not 0 < self.velocity_fraction <= 1:
            raise InputError(f"the velocity fraction is {self.velocity_fraction}", allowed="above 0, up to 1")
        if self.payload is not None:
            object.__setattr__(self, "payload", checked_body(self.payload))
        for limit in self.space:
            if not isinstance(limit, GeometricLimit):
                raise InputError(f"the limit {limit!r}", allowed="a subclass of GeometricLimit in `space`")
        for own in self.motion:
            if not isinstance(own, StateLimit):
                raise InputError(f"the limit {own!r}", allowed="a subclass of StateLimit in `motion`")

    def collision_model(self, robot: Robot) -> CollisionModel | None:
        """Makes the bodies and obstacles that the design keeps apart; None where collisions are not to be checked.

        Args:
            robot: the robot.
        """
        return self.surroundings.model(robot) if self.collision else None

    @property
    def static_effects(self) -> list[PlantEffect]:
        """The effects that follow from position, velocity and acceleration."""
        return [effect for effect in self.effects if effect.static]

    def settings(self) -> dict[str, Any]:
        """Writes them as plain data."""
        return {
            "velocity_fraction": self.velocity_fraction,
            "torque_margin": self.torque_margin if self.torque else None,
            "collision": self.collision,
            "clearance": self.clearance if self.collision else None,
            **self.surroundings.settings(),
            "space": [repr(limit) for limit in self.space],
            "motion": [repr(limit) for limit in self.motion],
            "effects": [asdict(effect) for effect in self.effects],
            "payload": _numbers(self.payload),
        }


@dataclass(frozen=True, kw_only=True)
class WeightOptions:
    """How rows and columns of the regressor count, and what is known before.

    Attributes:
        scaling: column scaling of the regressor in the criterion: none, nominal (each by the size its parameter has in
            the robot's description) or unit (each to unit length).
        noise: standard deviation of the torque noise of each joint (n,) [N m or N], comma-separated. Default: all
            alike. Calibration: of the measurement [m], of poses also [rad].
        after: what an earlier identification knows: the design adds what that lacks.
        task: with criterion ``i``, the motion whose torques are to be predicted.
    """

    scaling: str = "none"
    noise: Annotated[ArrayLike | None, Option(reads=numbers)] = None
    after: Prior | None = None
    task: Motion | None = None

    def settings(self) -> dict[str, Any]:
        """Writes them as plain data."""
        return {
            "scaling": self.scaling,
            "noise": _numbers(self.noise),
            "after": self.after is not None,
        }


@dataclass(frozen=True, kw_only=True)
class SearchOptions:
    """How long and where the search runs. The effort may be counts of one's own.

    Attributes:
        effort: search effort: quick, standard or thorough. It counts local solutions: the same seed gives the same
            design on a slow machine.
        seed: seed of the random numbers.
        time_limit: stop the search after this time [s] and keep the best design.
        keep_on_interrupt: on Ctrl-C during the search, end it and keep the best design so far; a second one ends all.
        solver: the local solver: `InteriorPoint` or `Ipopt`.
        workers: processes; as many as cores by default.
        executor: runs the searches instead of processes of its own.

    Raises:
        InputError: an unknown effort, or numbers out of range.
    """

    effort: Annotated[str | Effort, Option(choices="oed.experiments.searches.search:EFFORTS")] = "standard"
    seed: Seed = 0
    time_limit: float = math.inf
    keep_on_interrupt: Annotated[bool, Option(hidden=True)] = False
    solver: Solver = field(default_factory=_interior_point)
    workers: Annotated[int | None, Option(hidden=True)] = None
    executor: Executor | None = None

    def __post_init__(self) -> None:
        from oed.experiments.searches.search import EFFORTS, Effort

        if not isinstance(self.effort, Effort) and self.effort not in EFFORTS:
            raise InputError(f"effort {self.effort!r}", allowed=", ".join(EFFORTS))
        _whole("seed", self.seed, 0)
        if not self.time_limit > 0:
            raise InputError(f"the time limit is {self.time_limit} s", allowed="a positive number")

    @property
    def counts(self) -> Effort:
        """The effort in counts."""
        from oed.experiments.searches.search import EFFORTS, Effort

        return self.effort if isinstance(self.effort, Effort) else EFFORTS[self.effort]

    def settings(self) -> dict[str, Any]:
        """Writes what decides the result as plain data."""
        return {
            "seed": self.seed,
            "effort": asdict(self.counts),
            "time_limit": finite(self.time_limit),
            "solver": {"name": self.solver.name, **asdict(self.solver)},
        }


def _numbers(values: ArrayLike | None) -> list[float] | None:
    import numpy as np

    return None if values is None else np.asarray(values, dtype=float).tolist()


def _whole(name: str, value: int, least: int) -> None:
    if value < least or value != int(value):
        raise InputError(f"{name} is {value}", allowed=f"a whole number, at least {least}")
