"""What can be chosen of a design, in five groups; the defaults are a good experiment for any robot."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from oed.constraints import StateLimit
from oed.constraints.geometric import GeometricLimit
from oed.criteria import Prior
from oed.experiments.searches.search import EFFORTS, Effort
from oed.experiments.solvers import InteriorPoint, Solver
from oed.trajectories import Family, Fourier, check_family
from oed.trajectories import family as choose_family
from robots.collision import CollisionModel, Surroundings
from robots.common.errors import InputError
from robots.common.plain import finite
from robots.plants import PlantEffect
from robots.robot import Robot
from robots.signal_checks import checked_body
from robots.signals import Motion
from robots.terms import FrictionTerm


@dataclass(frozen=True, kw_only=True)
class ModelOptions:
    """Which model will be fitted to the experiment.

    Attributes:
        friction: ``polynomial``, ``coulomb-viscous``, the name of another friction term, or a term of one's own.
        offset: with torque offset columns.
        rotor: with rotor inertia columns.
        essential: leaves out base parameters whose torque, by the robot's description, stays below this share of each
            joint's on random motions; 0 keeps all.
        velocity_scale: of the Coulomb column tanh(dq / scale) [rad/s].
        payload_only: the criterion judges the ten parameters of a body on the flange alone: the arm counts as known, as
            in the difference of two logs of one path. The other options then matter for the torque limits only.
    """

    friction: str | FrictionTerm = "polynomial"
    offset: bool = False
    rotor: bool = True
    essential: float = 0.0
    velocity_scale: float = 0.02
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
        periods: how often the optimised part is repeated.
        strokes: with one stroke per joint to its velocity bound, both ways.
        home: pose (n,) at both ends [rad or m]; by default zero, or the nearest pose free of collisions.

    Raises:
        InputError: an unknown or unusable family, or a number of periods out of range.
    """

    family: str | Family = field(default_factory=Fourier)
    periods: int = 3
    strokes: bool = True
    home: ArrayLike | None = None

    def __post_init__(self) -> None:
        chosen = choose_family(self.family)
        check_family(chosen)
        object.__setattr__(self, "family", chosen)
        _whole("periods", self.periods, 1)

    @property
    def excitation(self) -> Family:
        """The family of the optimised part."""
        assert isinstance(self.family, Family)
        return self.family

    def settings(self) -> dict[str, Any]:
        """Writes them as plain data."""
        family = self.excitation.settings()
        fourier = {key: value for key, value in family.items() if key != "name"} if family["name"] == "fourier" else {}
        return {
            "family": family,
            **fourier,
            "periods": self.periods,
            "strokes": self.strokes,
            "home": None if self.home is None else np.asarray(self.home, dtype=float).tolist(),
        }


@dataclass(frozen=True, kw_only=True)
class LimitOptions:
    """Which limits the whole experiment keeps, besides position, acceleration and jerk.

    Attributes:
        velocity_fraction: share of the velocity limits to use. By default 1 for robots of the catalogue, and half for
            others, whose first motion should be slower.
        torque: keep the torque limits by the robot's nominal dynamics, where both are described.
        torque_margin: share of the torque limits kept for what the nominal dynamics are wrong by.
        collision: keep the arm clear of itself, of the floor and of the obstacles in the robot's file; the whole
            experiment is then proved free at all times. Without it the design is marked as not checked.
        clearance: to keep [m].
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
    surroundings: Surroundings = field(default_factory=Surroundings)
    space: Sequence[GeometricLimit] = ()
    motion: Sequence[StateLimit] = ()
    effects: Sequence[PlantEffect] = ()
    payload: ArrayLike | None = None

    def __post_init__(self) -> None:
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
            "payload": None if self.payload is None else np.asarray(self.payload, dtype=float).tolist(),
        }


@dataclass(frozen=True, kw_only=True)
class WeightOptions:
    """How rows and columns of the regressor count, and what is known before.

    Attributes:
        scaling: of the columns that the criterion judges: ``none``, ``nominal`` (each by the size its parameter has in
            the robot's description) or ``unit`` (each to unit length).
        noise: torque noise of each joint (n,) [N m or N]: rows count by one over it; all alike by default.
        after: what an earlier identification knows: the design adds what that lacks.
        task: with criterion ``i``, the motion whose torques are to be predicted.
    """

    scaling: str = "none"
    noise: ArrayLike | None = None
    after: Prior | None = None
    task: Motion | None = None

    def settings(self) -> dict[str, Any]:
        """Writes them as plain data."""
        return {
            "scaling": self.scaling,
            "noise": None if self.noise is None else np.asarray(self.noise, dtype=float).tolist(),
            "after": self.after is not None,
        }


@dataclass(frozen=True, kw_only=True)
class SearchOptions:
    """How long and where the search runs.

    Attributes:
        effort: ``quick``, ``standard``, ``thorough``, or counts of one's own.
        seed: of everything random: the same seed gives the same design.
        time_limit: for the search [s]; past it the best design so far is kept. Without it the same seed gives the same
            design on a fast and on a slow machine.
        keep_on_interrupt: on Ctrl-C during the search, end it and keep the best design so far; a second one ends all.
        solver: the local solver: `InteriorPoint` or `Ipopt`.
        workers: processes; as many as cores by default.
        executor: runs the searches instead of processes of its own.

    Raises:
        InputError: an unknown effort, or numbers out of range.
    """

    effort: str | Effort = "standard"
    seed: int = 0
    time_limit: float = np.inf
    keep_on_interrupt: bool = False
    solver: Solver = field(default_factory=InteriorPoint)
    workers: int | None = None
    executor: Executor | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.effort, Effort) and self.effort not in EFFORTS:
            raise InputError(f"effort {self.effort!r}", allowed=", ".join(EFFORTS))
        _whole("seed", self.seed, 0)
        if not self.time_limit > 0:
            raise InputError(f"the time limit is {self.time_limit} s", allowed="a positive number")

    @property
    def counts(self) -> Effort:
        """The effort in counts."""
        return self.effort if isinstance(self.effort, Effort) else EFFORTS[self.effort]

    def settings(self) -> dict[str, Any]:
        """Writes what decides the result as plain data."""
        return {
            "seed": self.seed,
            "effort": asdict(self.counts),
            "time_limit": finite(self.time_limit),
            "solver": {"name": self.solver.name, **asdict(self.solver)},
        }


def _whole(name: str, value: int, least: int) -> None:
    if value < least or value != int(value):
        raise InputError(f"{name} is {value}", allowed=f"a whole number, at least {least}")
