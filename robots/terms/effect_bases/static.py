"""Static effects, which depend on the present sample alone and are given by one symbolic expression."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import casadi
import numpy as np

from robots.batch import BatchFunction, batch_function, builds_expressions
from robots.common.arrays import Array
from robots.terms.effect_bases.base import Effect, JointEffect, Place
from robots.terms.situations.situation import Situation

if TYPE_CHECKING:
    from robots.robot import Robot


class Instant(NamedTuple):
    """Symbolic inputs of a static effect.

    Attributes:
        q: positions (n,) [rad or m].
        dq: velocities (n,) [rad/s or m/s].
        ddq: accelerations (n,) [rad/s2 or m/s2].
        rigid: torque of the rigid body and the rotors (n,) [N m or N].
        load: gear load (n,) [N m or N], see `Situation.load`.
        torque: torque of the whole base model (n,) [N m or N].
        sign: sign of the velocities (n,), as smooth as in the base model.
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
        """Creates the symbols for given numbers of joints and shape values."""
        sizes = [*(joints for _ in Instant._fields[:-1]), shapes]
        return Instant._make(casadi.SX.sym(name, size) for name, size in zip(Instant._fields, sizes, strict=True))

    def of(self, joint: int) -> Instant:
        """Selects the scalars of one joint, counted from 0; the shape is kept."""
        return Instant._make([*(symbol[joint] for symbol in self[:-1]), self.shape])


class StaticEffect(Effect):
    """An effect that depends on the present sample alone: its columns are one symbolic expression.

    The simulator, the experiment design (by automatic differentiation) and the diagnosis share it.
    """

    @abstractmethod
    def expression(self, robot: Robot, joint: Place, at: Instant) -> casadi.SX:
        """Builds the symbolic columns X (n, k); torque = X @ coefficients.

        Args:
            robot: the robot with n joints.
            joint: where the effect acts, counted from 1; None for the whole robot.
            at: the symbolic inputs.
        """

    def function(self, robot: Robot, joint: Place) -> casadi.Function:
        """Builds (q, dq, ddq, rigid, load, torque, sign, shape) -> X (n, k) as a CasADi function."""
        at = Instant.symbols(robot.n, len(self.shapes))
        X = self.expression(robot, joint, at)
        return casadi.Function(self.name, list(at), [casadi.densify(X)], list(Instant._fields), ["X"])

    def columns(self, situation: Situation, joint: Place, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates `expression` on all samples (N, n, k)."""
        s = situation
        shapes = np.broadcast_to(np.asarray(shape, dtype=float), (len(s), len(self.shapes)))
        return _evaluator(self, s.robot, joint)(s.q, s.dq, s.ddq, s.rigid, s.load, s.torque, s.sign, shapes)[0]


class StaticJointEffect(StaticEffect, JointEffect):
    """An effect of one joint on its own torque that depends on the present sample alone."""

    @abstractmethod
    def row(self, robot: Robot, joint: int, at: Instant) -> casadi.SX:
        """Builds the joint's columns (1, k) from its own scalars in `at` and all values of `at.shape`."""

    def expression(self, robot: Robot, joint: Place, at: Instant) -> casadi.SX:
        """Builds X (n, k): `row` in the joint's row, zero elsewhere."""
        assert joint is not None
        j = joint - 1
        row = self.row(robot, joint, at.of(j))
        X = casadi.SX(robot.n, row.shape[1])
        X[j, :] = row
        return X

    def local(self, situation: Situation, joint: int, shape: tuple[float, ...] = ()) -> Array:
        """Evaluates `row` on all samples (N, k)."""
        return _row_evaluator(self, situation.robot, joint)(situation, joint, shape)[:, 0]

    def slopes(self, situation: Situation, joint: int, coefficients: Array, shape: tuple[float, ...]) -> Array:
        """Evaluates the derivatives of the torque (N, 1 + s) by the base model's torque and by each shape value."""
        return _slope_evaluator(self, situation.robot, joint)(situation, joint, shape, coefficients)[:, 0]

    def undone(
        self, situation: Situation, joint: int, coefficients: Array, shape: tuple[float, ...], reading: Array
    ) -> Array:
        """Inverts the distortion of a torque reading by Newton's method.

        Args:
            situation: the motion and the base model's torque, from which the iteration starts (N samples).
            joint: the joint, counted from 1.
            coefficients: coefficients of the effect (k,).
            shape: values of its shape parameters.
            reading: distorted torque (N,) [N m or N].

        Returns:
            The base model's torque (N,) for which torque plus effect equals the reading [N m or N].
        """
        torque = situation.torque.copy()
        # Newton steps; the slope of the reading over the torque stays above a tenth.
        for _ in range(20):
            now = replace(situation, torque=torque, _cache={})
            off = torque[:, joint - 1] + self.local(now, joint, shape) @ coefficients - reading
            slope = 1.0 + self.slopes(now, joint, coefficients, shape)[:, 0]
            torque[:, joint - 1] -= off / np.maximum(slope, 0.1)
        return torque[:, joint - 1]

    columns = JointEffect.columns
    acts_on = JointEffect.acts_on


# Numpy, not compiled C: a column has few operations, and compiling the whole catalogue would take minutes.
@lru_cache(maxsize=512)
@builds_expressions
def _evaluator(effect: StaticEffect, robot: Robot, joint: Place) -> BatchFunction:
    return batch_function(effect.function(robot, joint), "vectorised")


class _JointFunction:
    """A function of one joint's signals and of constants. Only the signals that it needs are read."""

    def __init__(self, name: str, at: Instant, result: casadi.SX, *constants: casadi.SX) -> None:
        self.needed = [k for k in Instant._fields[:-1] if casadi.depends_on(result, getattr(at, k))]
        signals = [getattr(at, k) for k in self.needed]
        function = casadi.Function(name, [*signals, at.shape, *constants], [casadi.densify(result)])
        self.function = batch_function(function, "vectorised")

    def __call__(self, situation: Situation, joint: int, *constants: Sequence[float] | Array) -> Array:
        """Evaluates all samples (N, r, c)."""
        signals = (np.ascontiguousarray(getattr(situation, name)[:, joint - 1]) for name in self.needed)
        spread = (np.broadcast_to(np.asarray(x, dtype=float), (len(situation), len(x))) for x in constants)
        return self.function(*signals, *spread)[0]


@lru_cache(maxsize=512)
@builds_expressions
def _row_evaluator(effect: StaticJointEffect, robot: Robot, joint: int) -> _JointFunction:
    at = Instant.symbols(1, len(effect.shapes))
    return _JointFunction(effect.name, at, effect.row(robot, joint, at))


@lru_cache(maxsize=512)
@builds_expressions
def _slope_evaluator(effect: StaticJointEffect, robot: Robot, joint: int) -> _JointFunction:
    at = Instant.symbols(1, len(effect.shapes))
    row = effect.row(robot, joint, at)
    weights = casadi.SX.sym("coefficients", row.shape[1])
    slopes = casadi.jacobian(row @ weights, casadi.vertcat(at.torque, at.shape))
    return _JointFunction(effect.name, at, slopes, weights)
