"""Interface of effects beyond the base model.

A term of `robots.terms` belongs to every robot's model. An effect is what a robot may have besides: it acts on one
joint or on the whole robot, is linear in a few coefficients once its shape is given, and may depend on the past. The
plant plays it, the diagnosis looks for it, an extended model carries it: all by the same columns.
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
        has_thermal_memory: whether the motion before a log still acts in it, through heat.
        transient: whether it belongs to the logs in which it was found, and may be absent or different in others.
        shared_coefficient: whether all joints share one coefficient; the joints' estimates must then agree.
        lags: whether its coefficient is a time, which reversals determine only as well as their own times are known.
        acts_at_reversals: whether it acts at velocity reversals; an error in the reversal's time resembles it.
        acceleration_driven: whether changes of acceleration cause it. These are largest, and known least, at reversals.
        independent_of_acceleration: whether its torque does not depend on accelerations. It is then searched above
            their frequency band as well.
        needs_full_rate: whether its torque may change within a few samples, other than by the sign of a velocity. In
            thinned logs it is evaluated before the thinning.
        exogenous: whether it causes the motion instead of depending on it; no base model is fitted to such data.
        smooths_friction_sign: whether it makes friction change sign later or gradually. The sharpness of the sign is
            then fitted together with it.
        oscillates_over_range: whether it rises and falls over the joint's range, as a local fault does once.
        loads_gear: whether its torque loads the gears, so that load-dependent effects depend on it.
        preloads: whether its constant part is in the base model's offset.
        depends_on_gear_load: whether it depends on the load of the gears.
        acts_on_total_torque: whether it acts on the total torque, including other effects (`Situation.beyond`).
        distorts: whether it distorts the torque reading of its joint as a function of that torque. The base model
            follows such readings, so both are fitted together. A `StaticJointEffect`.
        undetermined_text: the finding's sentence if the logs determine none of its coefficients; empty by default.
        shapes: the parameters in which the columns are not linear.
        rivals: effects that resemble it, the closest first.
        experiments: kinds of experiment that separate it from them, the best first.
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
        """Gives the shape parameters without influence at these values."""
        return frozenset()

    def described(self, robot: Robot, joint: Place, shape: tuple[float, ...]) -> tuple[Coefficient, ...]:
        """Describes the coefficients at given shape values; an unused one has no name."""
        return self.parameters(robot, joint)

    def ranges(self, robot: Robot, joint: Place, shape: tuple[float, ...]) -> tuple[tuple[float, float], ...]:
        """Gives the range of each coefficient at given shape values; by default as in `parameters`."""
        return tuple((coefficient.lower, coefficient.upper) for coefficient in self.parameters(robot, joint))

    def ties(self, coefficients: Array) -> tuple[tuple[int, int, float], ...]:
        """Lists coefficients and shapes of the same quantity, with the standard deviation of their difference."""
        return ()

    def is_plausible(self, robot: Robot, joint: Place, coefficients: Array, shape: tuple[float, ...] = ()) -> bool:
        """Whether these values are physically plausible, for a shape if it is given.

        A value at its limit would be larger without the limit, and one below its least size is not significant.
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
            situation: what the robot did (N samples).
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
        """Gives the range in which each shape parameter is refined on these data; a point for a choice."""
        return tuple(shape.choices[:1] * 2 if shape.choices else (shape.lower, shape.upper) for shape in self.shapes)  # type: ignore[misc]

    def likely(
        self, situation: Situation, joint: Place, shape: tuple[float, ...], coefficients: Array
    ) -> tuple[tuple[float | None, ...], ...]:
        """Lists usual design values near a refined shape, such as whole numbers of waves per turn.

        Their parameters do not count as fitted, nor those that follow from the coefficients (k,). A parameter given as
        None keeps its refined value and counts as fitted.
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
        """Lists shapes in which the effect continues beyond a refined shape whose formula holds only locally.

        Each comes with the index of the shape parameter that is then undetermined.
        """
        return ()

    def sustained_shapes(self, situation: Situation, shape: tuple[float, ...]) -> tuple[tuple[float, ...], ...]:
        """Lists shapes whose formula holds for the whole duration, if that of a refined shape holds only locally.

        They assume a permanent effect; start and duration [s] are its first two shape parameters.
        """
        return ()

    def forms(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists shapes that a log may not distinguish; the most likely of them is used."""
        return ()

    def leakage(self, robot: Robot, joint: int, shape: tuple[float, ...] = ()) -> float:
        """Gives the fraction of the effect on a joint (from 0) that its formula may leave unexplained.

        This remainder must not count as another effect, because formulas hold to some per cent only.
        """
        return 0.08

    def acts_on(self, robot: Robot, joint: Place) -> tuple[int, ...]:
        """Lists the joints, counted from 0, whose torque the effect can change: the rows of `columns` not all zero."""
        return tuple(range(robot.n))

    def propose(
        self, situation: Situation, joint: Place, residual: Array, count: int = 8
    ) -> tuple[tuple[float, ...], ...]:
        """Lists the points of `grid` that are worth scanning on a residual (N, n), the best first.

        The residual is weighted by the noise, so that its product with an effect's torque is the explained part per
        unit [1/(N m) or 1/N]; zero where a joint rests.

        All of them, unless the effect knows a fast way to rank them. The ranking is a search: a false-alarm control
        must repeat it on every null log.
        """
        return self.grid(situation, joint)

    def complete(self, situation: Situation, joint: Place, shape: tuple[float, ...]) -> tuple[float, ...]:
        """Adds the optional shape parameters to a start of the search; the result may be reported without them."""
        return shape

    def gate(self, situation: Situation, joint: Place, measured: Array) -> NDArray[np.bool_] | None:
        """Flags the samples (N, n) that this effect makes useless as torque measurements; None for no such effect.

        Args:
            situation: what the robot did.
            joint: where the effect would act.
            measured: torque as logged (N, n) [N m or N].
        """
        return None

    def chance(self, situation: Situation, joint: Place, measured: Array) -> float:
        """Gives the probability that the logged torque (N, n) shows this effect by chance; 1 for most effects."""
        return 1.0

    def coordinate(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> tuple[str, Array]:
        """Gives the axis on which the effect shows in a picture: its label with unit, and the values (N,)."""
        return "time [s]", situation.t


class JointEffect(Effect):
    """An effect of one joint on its own torque alone."""

    @abstractmethod
    def local(self, situation: Situation, joint: int, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates the torque (N, k) of the joint per unit of each coefficient."""

    def columns(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> Array:
        """Places `local` into the joint's row."""
        assert joint is not None
        block = self.local(situation, joint, shape)
        X = np.zeros((len(situation), situation.robot.n, block.shape[1]))
        X[:, joint - 1] = block
        return X

    def acts_on(self, robot: Robot, joint: Place) -> tuple[int, ...]:
        """Names the joint itself."""
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
