"""Generalised momentum of an identified model, and what changes it apart from the drives and a contact."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import casadi
import numpy as np
from numpy.typing import ArrayLike

from estimation.models.model import Model
from robots.batch import BatchFunction, batch_function, builds_expressions
from robots.collision.kinematics import symbolic_frames
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.stretches import chunks
from robots.regressor import TorqueModel
from robots.terms.situations.flange_body import require_flange, with_body


@dataclass(frozen=True, eq=False)
class Dynamics:
    """The parts of tau = M(q) ddq + C dq + g + friction + offset that an observer needs.

    With the regressor Y and the parameters pi: the momentum is p = M dq = (Y(q, 0, dq) - Y(q, 0, 0)) pi, so that no
    mass matrix is needed. Its change is dp/dt = tau + tau_ext - beta, with beta = Y(q, dq, 0) pi - (dp/dq) dq
    = g - C' dq + friction + offset (De Luca and Mattone 2005).

    Attributes:
        torque_model: the terms, under the gravity of the log.
        columns: indices (b,) of the regressor's columns that carry a parameter.
        values: the parameters (b,).
        covariance: of the parameters (b, b), as far as they widen the band of a prediction.
        tool: position (3,) of the tool point in the flange's frame [m].
    """

    torque_model: TorqueModel
    columns: tuple[int, ...]
    values: Array
    covariance: Array
    tool: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.torque_model.robot.n

    def expressions(self, q: casadi.SX, dq: casadi.SX, pi: casadi.SX | casadi.DM) -> list[casadi.SX]:
        """Builds p, beta without friction, friction (n,) each, and the tool point's Jacobian (6, n).

        Args:
            q: positions (n,).
            dq: velocities (n,).
            pi: the parameters (b,), numbers or symbols.
        """
        regressor, still = self.torque_model.symbolic(self.columns), casadi.SX(self.n, 1)
        own = casadi.DM([float(self.torque_model.columns[i].friction) for i in self.columns])
        momentum = (regressor(q, still, dq) - regressor(q, still, still)) @ pi
        moving = regressor(q, dq, still)
        rest = moving @ (pi * (1 - own)) - casadi.jtimes(momentum, q, dq)
        outputs = [momentum, rest, moving @ (pi * own), self._jacobian(q)]
        return [casadi.densify(output) for output in outputs]

    def variance_expression(self, q: casadi.SX, dq: casadi.SX, ddq: casadi.SX) -> casadi.SX:
        """Builds diag(Y Cov Y') (n,) [(N m)^2]: the variance of the torque by the parameters' errors."""
        Y = self.torque_model.symbolic(self.columns)(q, dq, ddq)
        rows = []
        for j in range(self.n):
            used = Y[j, :].sparsity().get_triplet()[1]
            y, own = Y[j, used], self.covariance[np.ix_(used, used)]
            # Each product once: an upper triangle with the off-diagonal terms doubled.
            rows.append(casadi.dot(y.T, casadi.DM(2.0 * np.triu(own, 1) + np.diag(np.diag(own))) @ y.T))
        return casadi.densify(casadi.vertcat(*rows))

    def _jacobian(self, q: casadi.SX) -> casadi.SX:
        frames = symbolic_frames(self.torque_model.robot.chain)
        point = frames.flange_point(np.asarray(self.tool))
        columns = [
            casadi.vertcat(frames.shift(j, point), casadi.SX(3, 1) if joint.kind == "prismatic" else frames.axes[j])
            for j, joint in enumerate(frames.chain.joints)
        ]
        return casadi.substitute(casadi.horzcat(*columns), frames.q, q)

    @cached_property
    def evaluator(self) -> BatchFunction:
        """Evaluates `expressions` of (q, dq, pi)."""
        return _evaluator(self.torque_model, self.columns, self.tool)

    def __call__(self, q: Array, dq: Array) -> tuple[Array, Array, Array, Array]:
        """Evaluates `expressions` on arrays (N, n): p, beta without friction, friction (N, n), Jacobian (N, 6, n)."""
        pi = np.broadcast_to(self.values, (len(q), len(self.values)))
        p, rest, friction, jacobian = self.evaluator(q, dq, pi)
        return p[..., 0], rest[..., 0], friction[..., 0], jacobian

    def variance(self, q: Array, dq: Array, ddq: Array) -> Array:
        """Evaluates `variance_expression` (N, n)."""
        result = np.empty(q.shape)
        for rows in chunks(len(q)):
            Y = self.torque_model.regressor(q[rows], dq[rows], ddq[rows], columns=self.columns)
            result[rows] = np.einsum("tjp,tjp->tj", Y @ self.covariance, Y)
        return np.maximum(result, 0.0)


@lru_cache(maxsize=16)
@builds_expressions
def _evaluator(torque_model: TorqueModel, columns: tuple[int, ...], tool: tuple[float, float, float]) -> BatchFunction:
    # The parameters are inputs, so that the code is compiled once for all models of a robot.
    unused = np.zeros(len(columns))
    dynamics = Dynamics(torque_model, columns, unused, np.zeros((len(columns), len(columns))), tool)
    q, dq = (casadi.SX.sym(name, dynamics.n) for name in ("q", "dq"))
    pi = casadi.SX.sym("pi", len(columns))
    return batch_function(casadi.Function("dynamics", [q, dq, pi], dynamics.expressions(q, dq, pi)))


def covariance_root(covariance: Array) -> Array:
    """Gives a matrix (b, r) whose product with its transpose is the covariance."""
    values, vectors = np.linalg.eigh(covariance)
    kept = values > np.finfo(float).eps * max(float(values[-1]), 0.0)
    return vectors[:, kept] * np.sqrt(values[kept]) if kept.any() else np.zeros((len(values), 1))


def dynamics_of(
    model: Model,
    *,
    gravity: ArrayLike | None = None,
    payload: ArrayLike | None = None,
    tool: Sequence[float] | None = None,
) -> Dynamics:
    """Gives the dynamics of an identified model.

    Args:
        model: the model; its extensions are not in it.
        gravity: (3,) in the base frame [m/s2], where the base stands otherwise than described.
        payload: ten inertial parameters of a body on the flange, as `Log` has them.
        tool: position (3,) of the tool point in the flange's frame [m]; the flange by default.

    Raises:
        InputError: a model without inertial parameters, or a robot whose flange is not known.
    """
    require_inertia(model)
    require_flange(model.robot)
    place = np.zeros(3) if tool is None else np.asarray(tool, dtype=float)
    if place.shape != (3,) or not np.isfinite(place).all():
        raise InputError(f"a tool at {tool}", allowed="three finite numbers: x, y, z in the flange's frame [m]")
    torque_model = model.torque_model.under(gravity)
    columns, values = model.columns, model.values
    known = model.provenance.get("band_covariance")
    covariance = np.zeros((len(values), len(values))) if known is None else np.asarray(known, dtype=float)
    if payload is not None:
        parameters = np.zeros(torque_model.size)
        parameters[list(columns)] = values
        parameters = with_body(torque_model, parameters, np.asarray(payload, dtype=float))
        columns = tuple(np.union1d(columns, np.flatnonzero(parameters)).tolist())
        places = [columns.index(column) for column in model.columns]
        wider = np.zeros((len(columns), len(columns)))
        wider[np.ix_(places, places)] = covariance
        values, covariance = parameters[list(columns)], wider
    x, y, z = place.tolist()
    return Dynamics(torque_model, columns, values, covariance, (x, y, z))


def require_inertia(model: Model) -> None:
    """Refuses a model that has no inertial parameters.

    Raises:
        InputError: no column of the rigid body among its parameters.
    """
    if not any(column.term == "rigid_body" for column in model.parameters):
        raise InputError(
            "the model has no inertial parameters, so a contact cannot be separated from the arm's own inertia",
            remedy="identify the robot with oed identify, with a log in which all joints move",
        )
