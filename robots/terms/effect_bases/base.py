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
"""Share of its largest size within which a value is stopped by that: beside others it is told a little otherwise."""


class Effect(ABC):
    """A physical effect that the base model leaves out: torque = columns @ coefficients.

    Attributes:
        name: its name in a diagnosis.
        title: its name in reports.
        whole_robot: whether it acts on the robot as a whole; its joint is then None.
        rare: whether it is to be thought of last: it resembles a common effect, and robots seldom have it.
        depends_on: ``state`` where one and the same motion always meets it, ``time`` where it comes, goes or builds up.
        has_thermal_memory: whether what came before a log acts in it still: heat.
        transient: whether it belongs to the logs it is found in, and may be gone or different in others.
        shared_coefficient: whether it has one coefficient, that all joints share: each joint tells it, and they must
            agree.
        lags: whether its one coefficient is a time: reversals tell that no better than their own moments are known.
        acts_at_reversals: whether it acts where a joint turns round: an error in the moment of that resembles it.
        acceleration_driven: whether it acts by changes of acceleration: they are largest, and least known, where a
            joint turns round.
        independent_of_acceleration: whether its torque owes nothing to accelerations: it is looked for above the
            frequencies of those, too.
        needs_full_rate: whether its torque may turn round or pass within some samples, otherwise than by the sign of a
            velocity: where logs are thinned, it is evaluated before.
        exogenous: whether the arm's motion answers to it, and not it to the motion: no base model is fitted to that.
        smooths_friction_sign: whether it lets friction turn round later or over some time: how sharp its sign is shows
            beside it only.
        oscillates_over_range: whether it goes up and down over the joint's range, as a spot of it does once.
        loads_gear: whether the gears bear its torque: what grows with their load feels it.
        preloads: whether what it pulls with throughout is in the base model's offset.
        depends_on_gear_load: whether it depends on what the gears bear.
        acts_on_total_torque: whether it acts on all of the torque, that of other effects too (`Situation.beyond`).
        distorts: whether a reading of its joint's torque is wrong by it, as that torque has it: the base model follows
            such readings, and both are then fitted at once. A `StaticJointEffect`.
        undetermined_text: what is said of it where the logs determine none of its coefficients; nothing by default.
        shapes: the parameters that the columns are not linear in.
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
        """Gives which shape parameters mean nothing at these values."""
        return frozenset()

    def described(self, robot: Robot, joint: Place, shape: tuple[float, ...]) -> tuple[Coefficient, ...]:
        """Describes them at some shape values, where those say what they mean; one of no use there has no name."""
        return self.parameters(robot, joint)

    def ranges(self, robot: Robot, joint: Place, shape: tuple[float, ...]) -> tuple[tuple[float, float], ...]:
        """Gives the range of each coefficient at some shape values: as described, where shapes do not narrow it."""
        return tuple((coefficient.lower, coefficient.upper) for coefficient in self.parameters(robot, joint))

    def ties(self, coefficients: Array) -> tuple[tuple[int, int, float], ...]:
        """Lists coefficients and shapes that are one quantity told twice, and what they may differ by (deviation)."""
        return ()

    def is_plausible(self, robot: Robot, joint: Place, coefficients: Array, shape: tuple[float, ...] = ()) -> bool:
        """Whether a machine may have these values, of a shape where that is given.

        One that is stopped by its largest size wants to be more still, and one below its least is none.
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
        """Says in one plain sentence what the effect with these values means.

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
        """Lists the shape values to scan; none where this data can show none of them."""
        points: list[tuple[float, ...]] = [()]
        for shape in self.shapes:
            points = [(*point, value) for point in points for value in shape.grid]
        return tuple(points)

    def bounds(self, situation: Situation, joint: Place) -> tuple[tuple[float, float], ...]:
        """Gives the range of each shape parameter in which this data allow it to be refined; none of a choice."""
        return tuple(shape.choices[:1] * 2 if shape.choices else (shape.lower, shape.upper) for shape in self.shapes)  # type: ignore[misc]

    def likely(
        self, situation: Situation, joint: Place, shape: tuple[float, ...], coefficients: Array
    ) -> tuple[tuple[float | None, ...], ...]:
        """Lists shapes near a refined one that machines are built with, such as whole numbers of waves a turn.

        None of their parameters is counted as fitted; nor is what follows from the coefficients (k,) found there. One
        that is None stays as it was refined, and counts.
        """
        return ()

    def other_optima(
        self, situation: Situation, joint: Place, shape: tuple[float, ...], coefficients: Array
    ) -> tuple[tuple[tuple[float, ...], ...], ...]:
        """Lists other summits than a refined shape's, which a search from there does not reach.

        Each by shapes on its slopes, from the best of which it is climbed.
        """
        return ()

    def open_edges(self, shape: tuple[float, ...]) -> tuple[tuple[int, tuple[float, ...]], ...]:
        """Lists what it would be where it may go on beside a refined shape, by a formula that is near to it only.

        Each with the shape parameter that is then not told.
        """
        return ()

    def sustained_shapes(self, situation: Situation, shape: tuple[float, ...]) -> tuple[tuple[float, ...], ...]:
        """Lists shapes of formulas that stay true while it lasts, where a refined one's is near to it only.

        As if it acted throughout; when it does are the first two of its shape parameters, a start and a duration [s].
        """
        return ()

    def forms(self, situation: Situation, joint: Place) -> tuple[tuple[float, ...], ...]:
        """Lists shapes that a log may not tell apart though other motions do; the likeliest is taken of those."""
        return ()

    def leakage(self, robot: Robot, joint: int, shape: tuple[float, ...] = ()) -> float:
        """Gives the share of what the effect explains on a joint, from 0, that its formula may leave unexplained there.

        What is left must not be taken for another effect: formulas are true to some per cent of an effect.
        """
        return 0.08

    def acts_on(self, robot: Robot, joint: Place) -> tuple[int, ...]:
        """Lists the joints, counted from 0, whose torque the effect can change: the rows of `columns` not all zero."""
        return tuple(range(robot.n))

    def propose(
        self, situation: Situation, joint: Place, residual: Array, count: int = 8
    ) -> tuple[tuple[float, ...], ...]:
        """Lists the points of `grid` that are worth scanning on a residual (N, n), the best first.

        It is weighed by what noise makes of it, so that its products with an effect's torque are what that explains per
        unit [1/(N m) or 1/N]; zero where a joint rests.

        All of them, unless the effect knows a fast way to rank them. The ranking is a search: a false-alarm control
        must repeat it on every null log.
        """
        return self.grid(situation, joint)

    def complete(self, situation: Situation, joint: Place, shape: tuple[float, ...]) -> tuple[float, ...]:
        """Gives where to search a shape with all that the effect has where it is there; it may be told without some."""
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
        """Gives the chance that torque as logged (N, n) shows this effect by itself where it is not; 1 for most."""
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
