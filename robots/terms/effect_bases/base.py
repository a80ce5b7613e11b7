"""Interface of effects beyond the base model.

A term of `robots.terms` is part of every robot's model. An effect is an optional addition to it. It acts on one joint
or on the whole robot, is linear in a few coefficients once its shape is given, and may depend on past motion. The
plant, the diagnosis and an extended model all evaluate the same columns.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from robots.terms.effect_bases.parameters import Coefficient, Place, Shape
from robots.terms.situations.situation import Situation

if TYPE_CHECKING:
    from robots.robot import Robot

Array = NDArray[np.float64]
STOPPED = 0.02
"""Relative distance from a limit within which a value counts as at the limit."""


class Effect(ABC):
    """A physical effect that the base model does not contain: torque = columns @ coefficients.

    Attributes:
        name: its name in a diagnosis.
        title: its name in reports.
        whole_robot: whether it acts on the robot as a whole; its joint is then None.
        rare: whether it is considered last, because it resembles a common effect and is rare on robots.
        depends_on: ``state`` if the same motion always shows it, ``time`` if it starts, ends or builds up.
        has_thermal_memory: whether motion before a log still influences it, through stored heat.
        transient: whether it is specific to the logs in which it was found, and may be absent or different in others.
        shared_coefficient: whether all joints share one coefficient; the joints' estimates must then agree.
        lags: whether its coefficient is a delay. Reversals determine it only as accurately as their times are known.
        acts_at_reversals: whether it acts at velocity reversals; an error in the reversal's time resembles it.
        acceleration_driven: whether changes of acceleration cause it. These are largest, and least accurately known,
            at reversals.
        independent_of_acceleration: whether its torque does not depend on accelerations. It is then searched above
            their frequency band as well.
        needs_full_rate: whether its torque may change within a few samples, other than by the sign of a velocity. In
            thinned logs it is evaluated before the thinning.
        exogenous: whether it excites the arm but does not depend on its motion; no base model is fitted to such data.
        smooths_friction_sign: whether it makes friction change sign later or gradually. The sharpness of the sign is
            then fitted together with it.
        oscillates_over_range: whether it rises and falls several times over the joint's range.
        loads_gear: whether its torque loads the gears, so that load-dependent effects depend on it.
        preloads: whether its constant part is in the base model's offset.
        depends_on_gear_load: whether it depends on the load of the gears.
        acts_on_total_torque: whether it acts on the total torque, including other effects (`Situation.beyond`).
        distorts: whether it distorts the torque reading of its joint as a function of that torque. The distortion
            biases the base model, so both are fitted together. The effect must be a `StaticJointEffect`.
        undetermined_text: the finding's sentence if the logs determine none of its coefficients; empty by default.
        shapes: the parameters in which the columns are not linear.
        rivals: effects that resemble it, the closest first.
        experiments: kinds of experiment that separate it from its rivals, the best first.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    whole_robot: ClassVar[bool] = False
    rare: ClassVar[bool] = False
    depends_on: ClassVar[Literal["state", "time"]] = "state"
    has_thermal_memory: ClassVar[bool] = False
    transient: ClassVar[bool] = False
    shared_coefficient: ClassVar[bool] = False
    lags: ClassVar[bool] = False
    acts_at_reversals: ClassVar[bool] = False
    acceleration_driven: ClassVar[bool] = False
    independent_of_acceleration: ClassVar[bool] = False
    needs_full_rate: ClassVar[bool] = False
    exogenous: ClassVar[bool] = False
    smooths_friction_sign: ClassVar[bool] = False
    oscillates_over_range: ClassVar[bool] = False
    loads_gear: ClassVar[bool] = False
    preloads: ClassVar[bool] = False
    depends_on_gear_load: ClassVar[bool] = False
    acts_on_total_torque: ClassVar[bool] = False
    distorts: ClassVar[bool] = False
    undetermined_text: ClassVar[str] = ""
    shapes: ClassVar[tuple[Shape, ...]] = ()
    rivals: ClassVar[tuple[str, ...]] = ()
    experiments: ClassVar[tuple[str, ...]] = ()

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

    def ties(self, coefficients: Array) -> tuple[tuple[int, int, float], ...]:
        """Lists pairs of a coefficient and a shape parameter that describe the same quantity.

        Each entry is the coefficient's index, the shape parameter's index, and the standard deviation of their
        difference.
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
        return not any(
            limit and np.isclose(value, limit, rtol=STOPPED)
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
