"""Interface of effects beyond the base model.

A term of `robots.terms` is part of every robot's model. An effect is an optional addition to it. It acts on one joint
or on the whole robot, is linear in a few coefficients once its shape is given, and may depend on past motion. The
plant, the diagnosis and an extended model all evaluate the same columns.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from robots.common.arrays import Array
from robots.terms.effect_bases.capabilities import AboveBand, AtReversals, GearLoad, Persistence, Reading
from robots.terms.effect_bases.parameters import Coefficient, Place, Shape
from robots.terms.situations.situation import Situation

if TYPE_CHECKING:
    from robots.robot import Robot


class Effect(ABC):
    """A physical effect that the base model does not contain: torque = columns @ coefficients.

    Attributes:
        name: its name in a diagnosis.
        title: its name in reports.
        whole_robot: whether it acts on the robot as a whole; its joint is then None.
        rare: whether it is considered last, because it resembles a common effect and is rare on robots.
        persistence: whether the same motion always shows it.
        at_reversals: what it does at velocity reversals.
        gear_load: how it and the load of the gears depend on each other.
        reading: whether it changes how torque is read.
        above_band: whether it is searched above the frequencies at which accelerations are known.
        needs_full_rate: whether its torque may change within a few samples, other than by the sign of a velocity. In
            thinned logs it is evaluated before the thinning.
        constrained: whether the values of its coefficients limit each other, see `nearest`.
        undetermined_text: the finding's sentence if the logs determine none of its coefficients; empty by default.
        shapes: the parameters in which the columns are not linear.
        rivals: effects that resemble it, the closest first.
        experiments: kinds of experiment that separate it from its rivals, the best first.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    whole_robot: ClassVar[bool] = False
    rare: ClassVar[bool] = False
    persistence: ClassVar[Persistence] = Persistence.STATE
    at_reversals: ClassVar[AtReversals] = AtReversals.NOTHING
    gear_load: ClassVar[GearLoad] = GearLoad.NONE
    reading: ClassVar[Reading] = Reading.ADDS
    above_band: ClassVar[AboveBand] = AboveBand.NO
    needs_full_rate: ClassVar[bool] = False
    constrained: ClassVar[bool] = False
    undetermined_text: ClassVar[str] = ""
    shapes: ClassVar[tuple[Shape, ...]] = ()
    rivals: ClassVar[tuple[str, ...]] = ()
    experiments: ClassVar[tuple[str, ...]] = ()

    @property
    def loads_gear(self) -> bool:
        """Whether its torque loads the gears, so that effects that depend on their load depend on it."""
        return self.gear_load in (GearLoad.CAUSES, GearLoad.PRELOADS)

    @property
    def delays_all_torque(self) -> bool:
        """Whether it makes the torque of all joints late."""
        return self.at_reversals is AtReversals.LATE and self.whole_robot

    @abstractmethod
    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the k linear coefficients, in the order of the columns."""

    def unused(self, shape: tuple[float, ...]) -> frozenset[int]:
        """Returns the indices of the shape parameters that have no influence at these values."""
        return frozenset()

    def described(self, robot: Robot, joint: Place, shape: tuple[float, ...]) -> tuple[Coefficient, ...]:
        """Describes the coefficients at given shape values; an unused coefficient has an empty name."""
        return self.parameters(robot, joint)

    def ranges(self, robot: Robot, joint: Place, shape: tuple[float, ...]) -> tuple[tuple[float, float], ...]:
        """Returns the range of each coefficient at given shape values; by default that of `parameters`."""
        return tuple((coefficient.lower, coefficient.upper) for coefficient in self.parameters(robot, joint))

    def nearest(self, matrix: Array, target: Array, shape: tuple[float, ...]) -> Array:
        """Finds the possible coefficients (k,) that minimise ``|matrix @ coefficients - target|``.

        Only for an effect that is `constrained`: the `ranges` are all that limits others.

        Args:
            matrix: (r, k).
            target: (r,).
            shape: one value per entry of `shapes`.
        """
        raise NotImplementedError(self.name)

    def tangent(self, coefficients: Array, shape: tuple[float, ...]) -> Array | None:
        """Gives the directions (k, d) in which coefficients (k,) may vary, for given shape values; None for all."""
        return None

    def form_rows(self, coefficients: Array, shape: tuple[float, ...]) -> Array:
        """Gives rows (r, k) that measure how far coefficients are from a form, over the standard error of that form."""
        return np.zeros((0, len(coefficients)))

    def ties(self, coefficients: Array) -> tuple[tuple[int, int, float], ...]:
        """Lists pairs of a coefficient and a shape parameter that describe the same quantity.

        Each entry is the coefficient's index, the shape parameter's index, and the half-width of the 95 % interval of
        their difference.
        """
        return ()

    def is_plausible(self, robot: Robot, joint: Place, coefficients: Array, shape: tuple[float, ...] = ()) -> bool:
        """Returns whether these values are physically plausible, for a shape if it is given.

        A value at its limit is not: without the limit it would lie beyond. Nor is a value below its least size.
        """
        described = self.parameters(robot, joint)
        limits = [(c.lower, c.upper) for c in described]
        if any(abs(value) < c.least for value, c in zip(coefficients, described, strict=True)):
            return False
        # Relative distance from a limit within which a value counts as at the limit.
        return not any(
            limit and np.isclose(value, limit, rtol=0.02)
            for value, pair in zip(coefficients, limits, strict=True)
            for limit in pair
        )

    @abstractmethod
    def columns(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the torque per unit of each coefficient.

        Args:
            situation: the motion and the base model's torque (N samples).
            joint: where the effect acts, counted from 1; None for the whole robot.
            shape: one value per entry of `shapes`.

        Returns:
            X (N, n, k); torque = X @ coefficients [N m or N].
        """

    @abstractmethod
    def describe(
        self,
        joint: Place,
        coefficients: Array,
        shape: tuple[float, ...] = (),
        *,
        force: str = "N m",
        length: str = "rad",
    ) -> str:
        """Describes the effect with these values in one or two sentences.

        Args:
            joint: where it acts.
            coefficients: their values (k,).
            shape: one value per entry of `shapes`.
            force: the unit of the joint's torque.
            length: the unit of the joint's position.
        """

    def joints(self, robot: Robot) -> tuple[Place, ...]:
        """Lists where the effect can act: joints from 1, or (None,)."""
        return (None,) if self.whole_robot else tuple(range(1, robot.n + 1))

    def grid(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists the shape values to scan; empty if these data cannot show the effect."""
        points: list[tuple[float, ...]] = [()]
        for shape in self.shapes:
            points = [(*point, value) for point in points for value in shape.grid]
        return tuple(points)

    def bounds(self, situation: Situation, joint: Place) -> tuple[tuple[float, float], ...]:
        """Returns the range in which each shape parameter is refined; a single point if it has only few choices."""
        return tuple(shape.choices[:1] * 2 if shape.choices else (shape.lower, shape.upper) for shape in self.shapes)  # type: ignore[misc]

    def choices(self, robot: Robot, k: int) -> tuple[float, ...]:
        """Lists the only possible values of shape parameter k, if they are few; empty otherwise."""
        return self.shapes[k].choices

    def likely(
        self, situation: Situation, joint: Place, shape: tuple[float, ...], coefficients: Array
    ) -> tuple[tuple[float | None, ...], ...]:
        """Lists usual design values near a refined shape, such as whole numbers of waves per turn.

        A parameter with a usual value, or with one that follows from the coefficients (k,), does not count as fitted.
        A parameter given as None keeps its refined value and counts as fitted.
        """
        return ()

    def other_optima(
        self, situation: Situation, joint: Place, shape: tuple[float, ...], coefficients: Array
    ) -> tuple[tuple[tuple[float, ...], ...], ...]:
        """Lists starting shapes for other local optima that a search from the refined shape does not reach.

        Each entry holds several starts for one optimum; the search starts from the best of them.
        """
        return ()

    def open_edges(self, shape: tuple[float, ...]) -> tuple[tuple[int, tuple[float, ...]], ...]:
        """Lists neighbouring shapes that test whether an event starts earlier or ends later than its refined shape.

        It applies to effects whose formula holds only locally. Each shape comes with the index of the shape parameter
        that is undetermined if the effect continues there.
        """
        return ()

    def sustained_shapes(self, situation: Situation, shape: tuple[float, ...]) -> tuple[tuple[float, ...], ...]:
        """Lists shapes whose formula holds for a long duration, for a refined shape whose formula holds only locally.

        They cover all data. Start and duration [s] are their first two shape parameters.
        """
        return ()

    def forms(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists shapes between which a log may not distinguish; the most likely one is used."""
        return ()

    def leakage(self, robot: Robot, joint: int, shape: tuple[float, ...] = ()) -> float:
        """Returns the fraction of the effect on a joint (from 0) that its formula may leave unexplained.

        Formulas are accurate to some per cent only, so this remainder must not count as another effect.
        """
        return 0.08

    def acts_on(self, robot: Robot, joint: Place) -> tuple[int, ...]:
        """Lists the joints, counted from 0, whose torque the effect can change."""
        return tuple(range(robot.n))

    def propose(
        self, situation: Situation, joint: Place, residual: Array, count: int = 8
    ) -> tuple[tuple[float, ...], ...]:
        """Lists the points of `grid` to scan on a residual, the best first.

        By default these are all points. An effect with a fast way to rank them overrides this. The ranking is itself a
        search, so a false-alarm control must repeat it on every null log.

        Args:
            situation: the motion and the base model's torque (N samples).
            joint: where the effect would act.
            residual: (N, n) [1/(N m) or 1/N], weighted by the noise so that its product with an effect's torque
                measures the explained part; zero where a joint rests.
            count: the number of points to keep, if the effect ranks them.
        """
        return self.grid(situation, joint)

    def complete(self, situation: Situation, joint: Place, shape: tuple[float, ...]) -> tuple[float, ...]:
        """Adds start values of the optional shape parameters to a shape; they may be dropped again after the search."""
        return shape

    def gate(self, situation: Situation, joint: Place, measured: Array) -> NDArray[np.bool_] | None:
        """Flags the samples (N, n) that this effect makes useless as torque measurements; None for most effects.

        Args:
            situation: the motion and the base model's torque.
            joint: where the effect would act.
            measured: torque as logged (N, n) [N m or N].
        """
        return None

    def chance(self, situation: Situation, joint: Place, measured: Array) -> float:
        """Returns the probability that the logged torque (N, n) shows this effect by chance; 1 for most effects."""
        return 1.0

    def coordinate(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> tuple[str, Array]:
        """Returns the horizontal axis of the effect's plot: its label with unit, and the values (N,)."""
        return "time [s]", situation.t


class JointEffect(Effect):
    """An effect of one joint on its own torque alone."""

    @abstractmethod
    def local(self, situation: Situation, joint: int, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the torque (N, k) of the joint per unit of each coefficient."""

    def columns(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the torque (N, n, k): `local` in the joint's row, zero on all other joints."""
        assert joint is not None
        block = self.local(situation, joint, shape)
        X = np.zeros((len(situation), situation.robot.n, block.shape[1]))
        X[:, joint - 1] = block
        return X

    def acts_on(self, robot: Robot, joint: Place) -> tuple[int, ...]:
        """Returns the joint itself, counted from 0."""
        assert joint is not None
        return (joint - 1,)


__all__ = [
    "Coefficient",
    "Effect",
    "JointEffect",
    "Place",
    "Shape",
    "Situation",
]
