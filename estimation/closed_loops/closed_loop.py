"""The identified robot under its controller, simulated along the reference: motion without the measurement's noise."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import casadi
import numpy as np
from scipy.interpolate import CubicHermiteSpline

from robots.base_parameters import BaseParameters
from robots.common.arrays import Array
from robots.common.errors import InputError, SolverError
from robots.drives.dry_friction import dry_velocity
from robots.signals import Motion
from robots.terms import FrictionTerm


@dataclass(frozen=True, kw_only=True)
class Controller:
    """tau = feedforward + Kp (q_r - q) + Kd (dq_r - dq).

    Attributes:
        proportional: Kp (n,) [N m/rad or N/m].
        derivative: Kd (n,) [N m s/rad or N s/m].
        feedforward: reference motion -> torque (N, n) [N m or N]; None for none.
    """

    proportional: Array
    derivative: Array
    feedforward: Callable[[Motion], Array] | None = None

    def __post_init__(self) -> None:
        for name in ("proportional", "derivative"):
            gains = np.array(getattr(self, name), dtype=float)
            if gains.ndim != 1 or not (np.isfinite(gains) & (gains >= 0)).all():
                raise InputError(f"{name} gains {gains}", allowed="numbers that are zero or more, one per joint")
            object.__setattr__(self, name, gains)
        if self.proportional.shape != self.derivative.shape:
            raise InputError(f"{len(self.proportional)} and {len(self.derivative)} gains", allowed="one each a joint")


def stiff_controller(base: BaseParameters, values: Array, reference: Motion) -> Controller:
    """Makes a critically damped controller with the model's own feedforward, for robots whose own is not known.

    Args:
        base: base parameters of the model (b).
        values: their values (b,).
        reference: along which the inertia is looked at.
    """
    inertia = np.diagonal(inertia_matrices(base, values, reference), axis1=1, axis2=2).mean(axis=0)
    inertia = np.maximum(inertia, 1e-3 * max(float(inertia.max()), np.finfo(float).tiny))
    # Bandwidth of an undeclared controller [rad/s].
    bandwidth = 60.0
    return Controller(
        proportional=inertia * bandwidth**2,
        derivative=2 * inertia * bandwidth,
        feedforward=lambda motion: base.torque(motion.q, motion.dq, motion.ddq, values),
    )


def inertia_matrices(base: BaseParameters, values: Array, motion: Motion, count: int = 50) -> Array:
    """Evaluates the joints' inertia matrix at some poses of a motion (count, n, n) [kg m2]."""
    at = np.linspace(0, len(motion) - 1, min(len(motion), count)).astype(int)
    q, still = motion.q[at], np.zeros_like(motion.q[at])
    gravity = base.torque(q, still, still, values)
    columns = []
    for joint in range(motion.n):
        unit = still.copy()
        unit[:, joint] = 1.0
        columns.append(base.torque(q, still, unit, values) - gravity)
    matrix = np.stack(columns, axis=2)
    return np.asarray((matrix + matrix.transpose(0, 2, 1)) / 2)


class ClosedLoop:
    """Simulates base parameters under a controller.

    The integration is an implicit midpoint rule of second order. Inertia and smooth torques are evaluated at the
    predicted midpoint, the controller's damping and dry friction at the unknown velocity. Coulomb friction can
    therefore hold a joint without small steps.

    Args:
        base: base parameters of the model (b).
    """

    def __init__(self, base: BaseParameters) -> None:
        self.base = base
        self._dry = {column.joint - 1: k for k, column in enumerate(base.columns) if column.is_coulomb}
        self._width = _friction_widths(base)
        self._step = self._build()

    def simulate(self, values: Array, controller: Controller, reference: Motion, substeps: int = 2) -> Motion:
        """Runs the loop along a reference, from rest relative to it.

        Args:
            values: base parameters (b,).
            controller: with gains of n joints.
            reference: the motion that was commanded.
            substeps: per sample.

        Returns:
            The motion at the reference's times.

        Raises:
            InputError: a controller of another number of joints.
            SolverError: the loop is not stable: parameters of no robot, or gains that don't suit it.
        """
        n = reference.n
        if len(controller.proportional) != n:
            raise InputError(f"a controller of {len(controller.proportional)} joints", allowed=f"{n}")
        targets = _targets(controller, reference, substeps)
        gains = np.concatenate([controller.proportional, controller.derivative])
        state = np.concatenate([reference.q[0], reference.dq[0], reference.ddq[0]])
        states = [state[:, None]]
        # Samples are handed to CasADi's loop piece by piece.
        for inputs in _chunks(targets, 1000):
            loop = self._step.mapaccum(inputs.shape[1])
            outcome = np.asarray(loop(state, inputs, gains, values))
            states.append(outcome)
            state = outcome[:, -1]
            if not np.isfinite(state).all() or np.abs(state[:n] - reference.q).min(axis=0).max() > 1e3:
                raise SolverError(
                    "the simulated closed loop is not stable",
                    remedy="state the real controller's gains, or start from a WLS fit",
                )
        path = np.concatenate(states, axis=1)
        # Accelerations are those of the steps: at a sample, the mean of the steps before and after.
        steps = path[2 * n :, 1:]
        before, after = steps[:, substeps - 1 :: substeps], steps[:, substeps::substeps]
        ddq = np.concatenate([steps[:, :1], (before[:, :-1] + after) / 2, steps[:, -1:]], axis=1)
        at = path[:, ::substeps]
        return Motion(t=reference.t, q=at[:n].T, dq=at[n : 2 * n].T, ddq=ddq.T)

    def _build(self) -> casadi.Function:
        """One step: (state (3 n), [h, q_r, dq_r, feedforward] (3 n + 1), gains (2 n), values) -> state."""
        n, size = self.base.model.robot.n, self.base.size
        regressor = self.base.model.symbolic(self.base.independent)
        state, inputs = casadi.SX.sym("state", 3 * n), casadi.SX.sym("inputs", 3 * n + 1)
        gains, values = casadi.SX.sym("gains", 2 * n), casadi.SX.sym("values", size)
        q, v, a = state[:n], state[n : 2 * n], state[2 * n :]
        h, target, speed, forward = inputs[0], inputs[1 : n + 1], inputs[n + 1 : 2 * n + 1], inputs[2 * n + 1 :]
        smooth = casadi.SX(values)
        for k in self._dry.values():
            smooth[k] = 0
        middle, predicted = q + h / 2 * v, v + h / 2 * a
        speeds, unknown = casadi.SX.sym("dq", n), casadi.SX.sym("ddq", n)
        torque = regressor(middle, speeds, unknown) @ smooth
        still = casadi.substitute(torque, unknown, casadi.SX.zeros(n))
        inertia = casadi.substitute(casadi.jacobian(torque, unknown), speeds, predicted)
        # A light joint's viscous friction is stiff: its slope, too, is taken at the unknown velocity.
        slope = casadi.fmax(casadi.diag(casadi.jacobian(still, speeds)), 0)
        bias, slope = (casadi.substitute(part, speeds, predicted) for part in (still, slope))
        bias = bias - slope * predicted
        matrix = 2 / h * inertia + casadi.diag(gains[n:] + slope)
        # The position error is that of the midpoint, a half step of the unknown velocity on.
        matrix = matrix + casadi.diag(gains[:n] * h / 2)
        right = 2 / h * inertia @ v + gains[:n] * (target - q) + gains[n:] * speed + forward - bias
        z = casadi.solve(matrix, right)
        if self._dry:
            z = self._with_dry_friction(matrix, right, z, values)
        new = 2 * z - v
        return casadi.Function("step", [state, inputs, gains, values], [casadi.vertcat(q + h * z, new, (new - v) / h)])

    def _with_dry_friction(self, matrix: casadi.SX, right: casadi.SX, z: casadi.SX, values: casadi.SX) -> casadi.SX:
        """Solves matrix z + f1 tanh(z / width) = right, joint after joint."""
        n = z.shape[0]
        current = [z[j] for j in range(n)]
        # Gauss-Seidel rounds on the joints' coupled dry friction: geared joints hardly feel each other's. The last ones
        # mend the straight-lined friction by Newton steps towards tanh.
        rounds = 12
        for round_ in range(rounds):
            newton = 3 if round_ >= rounds - 3 else 0
            for j in range(n):
                rest = right[j] - sum((matrix[j, k] * current[k] for k in range(n) if k != j), start=casadi.SX(0))
                if j in self._dry:
                    # A friction that drives would make the step ambiguous; on the way to a fit it may occur.
                    limit = casadi.fmax(values[self._dry[j]], 0)
                    current[j] = dry_velocity(rest, matrix[j, j], limit, float(self._width[j]), newton)
                else:
                    current[j] = rest / matrix[j, j]
        return casadi.vertcat(*current)


class _Targets(NamedTuple):
    """Per substep: its length, and what the controller wants in its middle."""

    inputs: Array  # (3 n + 1, N)


def _targets(controller: Controller, reference: Motion, substeps: int) -> _Targets:
    t = reference.t
    share = np.arange(substeps) / substeps
    starts = (t[:-1, None] + np.diff(t)[:, None] * share).reshape(-1)
    h = np.repeat(np.diff(t) / substeps, substeps)
    at = starts + h / 2
    q = CubicHermiteSpline(t, reference.q, reference.dq)(at)
    dq = CubicHermiteSpline(t, reference.dq, reference.ddq)
    middle = Motion(t=at, q=q, dq=dq(at), ddq=dq.derivative()(at))
    forward = np.zeros_like(q) if controller.feedforward is None else controller.feedforward(middle)
    return _Targets(np.concatenate([h[:, None], middle.q, middle.dq, forward], axis=1).T)


def _chunks(targets: _Targets, size: int) -> Iterator[Array]:
    for start in range(0, targets.inputs.shape[1], size):
        yield targets.inputs[:, start : start + size]


def _friction_widths(base: BaseParameters) -> Array:
    """Per joint the speed below which its Coulomb friction fades (n,)."""
    n = base.model.robot.n
    widths = np.full(n, 1e-6)
    for term in base.model.terms:
        if isinstance(term, FrictionTerm):
            widths = np.maximum(np.full(n, 1.0) * np.array(term.velocity_scale), widths)
    return widths
