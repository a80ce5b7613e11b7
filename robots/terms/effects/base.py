"""What an effect beyond the base model must say of itself to be played, found, named and added to a model.

A term of `robots.terms` belongs to every robot's model. An effect is what a robot may have besides: it acts on one
joint or on the whole robot, is linear in a few coefficients once its shape is given, and may depend on the past. The
plant plays it, the diagnosis looks for it, an extended model carries it: all by the same columns.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, ClassVar, Literal, NamedTuple

import casadi
import numpy as np
from numpy.typing import NDArray

from robots.batch import BatchFunction, batch_function
from robots.terms.effects.situation import Situation

if TYPE_CHECKING:
    from robots.robot import Robot

Array = NDArray[np.float64]
Place = int | None
"""Where an effect acts: a joint, counted from 1, or None for the whole robot."""


@dataclass(frozen=True)
class Shape:
    """A parameter that shapes an effect's columns, and that they are not linear in.

    Attributes:
        name: such as ``stribeck_velocity``.
        unit: its unit.
        lower: the least value that is physically possible.
        upper: the largest.
        scale: ``log`` where values differ by factors, ``linear`` where by steps.
        grid: the values that a scan tries where the data give none (see `Effect.grid`).
        inexact: standard error that the formula itself has, beside that of the data: no change is quite sudden, no push
            has quite that form. In the parameter's unit; a share of the value on a logarithmic scale.
    """

    name: str
    unit: str
    lower: float
    upper: float
    scale: Literal["log", "linear"] = "log"
    grid: tuple[float, ...] = ()
    inexact: float = 0.0


@dataclass(frozen=True)
class Coefficient:
    """A parameter that an effect's torque is linear in.

    Attributes:
        name: such as ``stribeck_torque``.
        unit: its unit, in which the column is N m (or N) per one.
        lower: the least value that is physically possible.
        upper: the largest.
    """

    name: str
    unit: str
    lower: float = -np.inf
    upper: float = np.inf


class Effect(ABC):
    """A physical effect that the base model leaves out: torque = columns @ coefficients.

    Attributes:
        name: its name in a diagnosis.
        title: its name for people.
        whole_robot: whether it acts on the robot as a whole; its joint is then None.
        rare: whether it is to be thought of last: it resembles a common effect, and robots seldom have it.
        depends_on: ``state`` where one and the same motion always meets it, ``time`` where it comes, goes or builds up.
        passing: whether it belongs to the logs it is found in, and may be gone or different in others.
        shapes: the parameters that the columns are not linear in.
        rivals: effects that resemble it, the closest first.
        experiments: kinds of experiment that separate it from them, the best first.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    whole_robot: ClassVar[bool] = False
    rare: ClassVar[bool] = False
    depends_on: ClassVar[Literal["state", "time"]] = "state"
    passing: ClassVar[bool] = False
    shapes: ClassVar[tuple[Shape, ...]] = ()
    rivals: ClassVar[tuple[str, ...]] = ()
    experiments: ClassVar[tuple[str, ...]] = ()

    @abstractmethod
    def parameters(self, robot: Robot, joint: Place) -> tuple[Coefficient, ...]:
        """Describes the k linear coefficients, in the order of the columns."""

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
        """Gives the range of each shape parameter in which this data allow it to be refined."""
        return tuple((shape.lower, shape.upper) for shape in self.shapes)

    def acts_on(self, robot: Robot, joint: Place) -> tuple[int, ...]:
        """Lists the joints, counted from 0, whose torque the effect can change: the rows of `columns` not all zero."""
        return tuple(range(robot.n))

    def propose(
        self, situation: Situation, joint: Place, residual: Array, count: int = 8
    ) -> tuple[tuple[float, ...], ...]:
        """Lists the points of `grid` that are worth scanning on a residual (N, n), the best first.

        All of them, unless the effect knows a fast way to rank them. The ranking is a search: a false-alarm control
        must repeat it on every null log.
        """
        return self.grid(situation, joint)

    def gate(self, situation: Situation, joint: Place, measured: Array) -> NDArray[np.bool_] | None:
        """Flags the samples (N, n) that this effect makes useless as torque measurements; None for no such effect.

        Args:
            situation: what the robot did.
            joint: where the effect would act.
            measured: torque as logged (N, n) [N m or N].
        """
        return None

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


class Instant(NamedTuple):
    """What a static effect depends on, symbolic.

    Attributes:
        q: positions (n,) [rad or m].
        dq: velocities (n,) [rad/s or m/s].
        ddq: accelerations (n,) [rad/s2 or m/s2].
        rigid: torque of the rigid body and the rotors (n,) [N m or N].
        load: torque that passes the gears (n,) [N m or N]: `rigid` without the rotors'.
        torque: torque of the whole base model (n,) [N m or N].
        sign: sign of the velocities as the base model takes it (n,): smooth where that is.
        shape: one value per entry of the effect's `shapes`.
    """

    q: casadi.SX
    dq: casadi.SX
    ddq: casadi.SX
    rigid: casadi.SX
    load: casadi.SX
    torque: casadi.SX
    sign: casadi.SX
    shape: casadi.SX

    @staticmethod
    def symbols(joints: int, shapes: int) -> Instant:
        """Makes symbols for so many joints and shape values."""
        sizes = [*(joints for _ in Instant._fields[:-1]), shapes]
        return Instant._make(casadi.SX.sym(name, size) for name, size in zip(Instant._fields, sizes, strict=True))

    def of(self, joint: int) -> Instant:
        """Picks one joint's scalars, counted from 0; the shape is for all."""
        return Instant._make([*(symbol[joint] for symbol in self[:-1]), self.shape])


class StaticEffect(Effect):
    """An effect that depends on this instant alone: its columns are one symbolic expression.

    The simulator, a design by automatic differentiation and the diagnosis share it.
    """

    @abstractmethod
    def expression(self, robot: Robot, joint: Place, at: Instant) -> casadi.SX:
        """Builds X (n, k), symbolic.

        Args:
            robot: the robot with n joints.
            joint: where the effect acts, counted from 1; None for the whole robot.
            at: what the columns are built from.
        """

    def function(self, robot: Robot, joint: Place) -> casadi.Function:
        """Builds (q, dq, ddq, rigid, load, torque, sign, shape) -> X (n, k) as a CasADi function."""
        at = Instant.symbols(robot.n, len(self.shapes))
        X = self.expression(robot, joint, at)
        return casadi.Function(self.name, list(at), [casadi.densify(X)], list(Instant._fields), ["X"])

    def columns(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates `expression` on all samples."""
        s = situation
        shapes = np.broadcast_to(np.asarray(shape, dtype=float), (len(s), len(self.shapes)))
        return _evaluator(self, s.robot, joint)(s.q, s.dq, s.ddq, s.rigid, s.load, s.torque, s.sign, shapes)[0]


class StaticJointEffect(StaticEffect, JointEffect):
    """An effect of one joint on its own torque, that depends on this instant alone."""

    @abstractmethod
    def row(self, robot: Robot, joint: int, at: Instant) -> casadi.SX:
        """Builds (1, k) from the joint's own scalars in `at`; all of `at.shape`."""

    def expression(self, robot: Robot, joint: Place, at: Instant) -> casadi.SX:
        """Places `row` into the joint's row."""
        assert joint is not None
        j = joint - 1
        row = self.row(robot, joint, at.of(j))
        X = casadi.SX(robot.n, row.shape[1])
        X[j, :] = row
        return X

    def local(self, situation: Situation, joint: int, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates `row` on all samples."""
        s, j = situation, joint - 1
        shapes = np.broadcast_to(np.asarray(shape, dtype=float), (len(s), len(self.shapes)))
        signals = (np.ascontiguousarray(a[:, j]) for a in (s.q, s.dq, s.ddq, s.rigid, s.load, s.torque, s.sign))
        return _row_evaluator(self, s.robot, joint)(*signals, shapes)[0][:, 0]

    columns = JointEffect.columns
    acts_on = JointEffect.acts_on


# Numpy, not compiled C: a column is a handful of operations, and a catalogue of them would take minutes to compile.
@lru_cache(maxsize=512)
def _evaluator(effect: StaticEffect, robot: Robot, joint: Place) -> BatchFunction:
    return batch_function(effect.function(robot, joint), "vectorised")


@lru_cache(maxsize=512)
def _row_evaluator(effect: StaticJointEffect, robot: Robot, joint: int) -> BatchFunction:
    at = Instant.symbols(1, len(effect.shapes))
    row = effect.row(robot, joint, at)
    return batch_function(casadi.Function(effect.name, list(at), [casadi.densify(row)]), "vectorised")


__all__ = [
    "Coefficient",
    "Effect",
    "Instant",
    "JointEffect",
    "Place",
    "Shape",
    "Situation",
    "StaticEffect",
    "StaticJointEffect",
]
