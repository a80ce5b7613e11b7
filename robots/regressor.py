"""The torque model: a robot, the terms that act in it, and their regressor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import casadi
import numpy as np
from numpy.typing import ArrayLike

from robots.batch import BatchFunction, batch_function, builds_expressions
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.robot import MASSES_REMEDY, Robot
from robots.terms import (
    COULOMB_VISCOUS,
    POLYNOMIAL,
    TERMS,
    BendingFriction,
    Column,
    FrictionPolynomial,
    FrictionTerm,
    RigidBody,
    RotorInertia,
    Term,
    TorqueOffset,
)

FRICTIONS = {"polynomial": POLYNOMIAL, "coulomb-viscous": COULOMB_VISCOUS}


@dataclass(frozen=True)
class TorqueModel:
    """tau = Y(q, dq, ddq) pi, the terms' columns side by side.

    Attributes:
        robot: the robot with n joints.
        terms: the effects; together they have p parameters.
    """

    robot: Robot
    terms: tuple[Term, ...]

    @cached_property
    def columns(self) -> tuple[Column, ...]:
        """The p parameters, in the order of the regressor's columns."""
        columns = tuple(column for term in self.terms for column in term.columns(self.robot))
        known: set[str] = set()
        for column in columns:
            if not column.unit:
                raise InputError(f"the parameter {column.name} of the term {column.term!r} has no unit")
            if column.name in known:
                raise InputError(
                    f"the term {column.term!r} has a parameter {column.name}, which exists already",
                    remedy="give its symbol another name",
                )
            known.add(column.name)
        return columns

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters' names (p,)."""
        return tuple(column.name for column in self.columns)

    @property
    def size(self) -> int:
        """p, the number of parameters."""
        return len(self.columns)

    @cached_property
    def nominal(self) -> Array:
        """The robot description's parameters (p,), NaN where it states none."""
        return np.concatenate([term.nominal(self.robot) for term in self.terms])

    @property
    def described(self) -> bool:
        """Whether the robot's description states all parameters."""
        return bool(np.isfinite(self.nominal).all())

    def require_description(self, purpose: str) -> Array:
        """Gives the robot description's parameters (p,).

        Args:
            purpose: what needs them, such as "a simulation".

        Raises:
            InputError: naming the first joint with a parameter that the description does not state.
        """
        if not self.described:
            column = self.columns[int(np.argmin(np.isfinite(self.nominal)))]
            missing = "masses" if column.term == "rigid_body" else column.name
            raise InputError(
                f"{purpose} needs {missing}, which the description of {self.robot.name} does not state",
                joint=column.joint,
                remedy=MASSES_REMEDY if missing == "masses" else "state it under dynamics in a robot YAML",
            )
        return self.nominal

    def under(self, gravity: ArrayLike | None) -> TorqueModel:
        """Gives the model on a base that stands otherwise, the same object for the same gravity.

        Args:
            gravity: (3,) in the base frame [m/s2]; None as the robot's description has it.
        """
        robot = self.robot.under(gravity)
        if robot is self.robot:
            return self
        models: dict[Robot, TorqueModel] = self.__dict__.setdefault("_models", {})
        return models.setdefault(robot, TorqueModel(robot, self.terms))

    @cached_property
    def _expression(self) -> tuple[list[casadi.SX], casadi.SX]:
        n = self.robot.n
        q, dq, ddq = (casadi.SX.sym(name, n) for name in ("q", "dq", "ddq"))
        parts = [term.regressor(self.robot, q, dq, ddq) for term in self.terms]
        for term, part in zip(self.terms, parts, strict=True):
            shape = (n, len(term.columns(self.robot)))
            if part.shape != shape:
                raise InputError(f"the term {term.name!r} gives columns of shape {part.shape}", allowed=f"{shape}")
        return [q, dq, ddq], casadi.horzcat(*parts)

    def symbolic(self, columns: Sequence[int] | None = None) -> casadi.Function:
        """Builds (q, dq, ddq) -> Y (n, p') as a CasADi function, of all columns or of the given ones."""
        inputs, Y = self._expression
        chosen = Y if columns is None else Y[:, list(columns)]
        return casadi.Function("regressor", inputs, [chosen], ["q", "dq", "ddq"], ["Y"])

    def adjoint(self, columns: Sequence[int] | None = None) -> casadi.Function:
        """Builds the reverse mode of `symbolic`.

        Args:
            columns: indices of the p' columns that are wanted; all by default.

        Returns:
            (q, dq, ddq, Ybar) -> the gradients (n,) of sum(Ybar * Y) by q, dq and ddq; Ybar (n p',) lists the
            weights row by row.
        """
        inputs, Y = self._expression
        chosen = Y if columns is None else Y[:, list(columns)]
        weights = casadi.SX.sym("Ybar", chosen.shape[0] * chosen.shape[1])
        total = casadi.dot(weights, casadi.densify(casadi.vec(chosen.T)))
        gradients = [casadi.densify(casadi.gradient(total, symbol)) for symbol in inputs]
        return casadi.Function("adjoint", [*inputs, weights], gradients)

    @builds_expressions
    def evaluator(self, columns: Sequence[int] | None = None, backend: str = "auto") -> BatchFunction:
        """Gives the evaluator of `regressor`, built once.

        Args:
            columns: indices of the columns wanted; all by default.
            backend: see `robots.batch.batch_function`.
        """
        key = (None if columns is None else tuple(int(c) for c in columns), backend)
        evaluators: dict[object, BatchFunction] = self.__dict__.setdefault("_evaluators", {})
        if key not in evaluators:
            evaluators[key] = batch_function(self.symbolic(columns), backend)
        return evaluators[key]

    def regressor(
        self,
        q: ArrayLike,
        dq: ArrayLike,
        ddq: ArrayLike,
        *,
        columns: Sequence[int] | None = None,
        backend: str = "auto",
        out: Array | None = None,
    ) -> Array:
        """Evaluates Y on N samples.

        Args:
            q: positions (N, n) [rad or m].
            dq: velocities (N, n) [rad/s or m/s].
            ddq: accelerations (N, n) [rad/s2 or m/s2].
            columns: indices of the p' columns wanted; all by default.
            backend: see `robots.batch.batch_function`.
            out: an array (N, n, p') to write into.

        Returns:
            Y (N, n, p'); ``Y.reshape(N * n, p')`` goes sample by sample, joint by joint.
        """
        arrays = [np.atleast_2d(np.asarray(array, dtype=float)) for array in (q, dq, ddq)]
        return self.evaluator(columns, backend)(*arrays, out=None if out is None else (out,))[0]

    def torque(
        self,
        q: ArrayLike,
        dq: ArrayLike,
        ddq: ArrayLike,
        parameters: ArrayLike,
        *,
        columns: Sequence[int] | None = None,
    ) -> Array:
        """Evaluates tau = Y pi (N, n) [N m or N].

        Args:
            q: positions (N, n) [rad or m].
            dq: velocities (N, n) [rad/s or m/s].
            ddq: accelerations (N, n) [rad/s2 or m/s2].
            parameters: of the columns that are used (p',).
            columns: indices of the p' columns that are used; all by default.

        Raises:
            InputError: not as many parameters as columns.
        """
        pi = np.asarray(parameters, dtype=float)
        expected = self.size if columns is None else len(columns)
        if pi.shape != (expected,):
            raise InputError(f"{pi.shape} parameters", allowed=f"({expected},)")
        arrays = [np.atleast_2d(np.asarray(array, dtype=float)) for array in (q, dq, ddq)]
        samples, chunk = arrays[0].shape[0], 4096
        tau = np.empty((samples, self.robot.n))
        # In chunks: the regressor of a long log would not fit into memory.
        for start in range(0, samples, chunk):
            rows = slice(start, start + chunk)
            tau[rows] = self.regressor(*(array[rows] for array in arrays), columns=columns) @ pi
        return tau

    def friction_at(self, speed: ArrayLike) -> Array:
        """Evaluates each friction column on its own joint (p,); zero for other columns.

        Args:
            speed: joint velocities (n,) [rad/s or m/s].
        """
        chosen = [k for k, column in enumerate(self.columns) if column.friction]
        values, n = np.zeros(self.size), self.robot.n
        if chosen:
            Y = self.symbolic(chosen)(np.zeros(n), np.asarray(speed, dtype=float), np.zeros(n)).full()
            values[chosen] = Y[[self.columns[k].joint - 1 for k in chosen], range(len(chosen))]
        return values

    def __getstate__(self) -> dict[str, object]:
        # Symbols and loaded libraries do not cross process borders; they are rebuilt where they are needed.
        return {"robot": self.robot, "terms": self.terms}

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)


def default_model(
    robot: Robot,
    *,
    friction: str | FrictionTerm = "polynomial",
    velocity_scale: float | tuple[float, ...] = 0.0,
    rotor: bool = True,
    offset: bool = True,
) -> TorqueModel:
    """Builds rigid body + friction + rotor inertia + torque offset.

    Args:
        robot: the robot.
        friction: ``polynomial`` (f1..f4, thesis eq. 35), ``coulomb-viscous`` (f1, f2), the name of another friction
            term, or a term of one's own; its velocity scale is replaced.
        velocity_scale: see `FrictionPolynomial`.
        rotor: with rotor inertia.
        offset: with a torque offset on each joint.

    Raises:
        InputError: an unknown friction model.
    """
    terms: list[Term] = [RigidBody(), friction_term(friction, velocity_scale)]
    if rotor:
        terms.append(RotorInertia())
    if offset:
        terms.append(TorqueOffset())
    return TorqueModel(robot, tuple(terms))


def friction_term(choice: str | FrictionTerm, velocity_scale: float | tuple[float, ...] = 0.0) -> FrictionTerm:
    """Gives the friction term of a name, or the one given, with a velocity scale.

    Raises:
        InputError: an unknown friction model.
    """
    if isinstance(choice, FrictionTerm):
        return replace(choice, velocity_scale=velocity_scale)
    if choice in FRICTIONS:
        return FrictionPolynomial(powers=FRICTIONS[choice], velocity_scale=velocity_scale)
    # The built-in terms have names above, or are made from the data.
    built_in = (FrictionPolynomial.name, BendingFriction.name)
    own = [name for name in TERMS if name not in built_in and issubclass(TERMS[name], FrictionTerm)]
    if choice not in own:
        TERMS.refuse_failed(choice)
        if choice not in TERMS:
            raise InputError(f"friction model {choice!r}", allowed=", ".join([*FRICTIONS, *own]))
        raise InputError(f"the term {choice!r} is no friction", allowed=", ".join([*FRICTIONS, *own]))
    kind = TERMS[choice]
    assert issubclass(kind, FrictionTerm)
    return kind(velocity_scale=velocity_scale)
