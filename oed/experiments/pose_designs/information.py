"""What each pose informs of the errors of a robot: rows of the scaled Jacobian."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi
import numpy as np
from numpy.typing import NDArray

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.geometry_errors.measurements import Measurement, Setup
from robots.geometry_errors.model import GeometryModel
from robots.geometry_errors.poses import MeasuredPoses
from robots.geometry_errors.reduction import reduce_columns
from robots.geometry_errors.symbolic import SymbolicArm, symbolic_jacobian
from robots.geometry_errors.terms import TERMS, ErrorParameter, error_term
from robots.geometry_errors.virtual import random_positions
from robots.robot import Robot

REFERENCE = 300
"""Random poses by which the errors that poses distinguish are chosen."""

UNSUITED = ("backlash", "load_backlash", "time_offset", "thermal_growth", "base_motion")
"""Kinds that depend on more than the pose, or jump with it."""


class PoseInformation:
    """Scaled Jacobians of poses: rows in standard deviations of the noise, columns in usual sizes of the parameters.

    Args:
        robot: the robot.
        measurement: what is measured.
        kinds: of errors.
        noise: standard deviation by unit.

    Raises:
        InputError: a kind that depends on more than the pose or jumps with it, or that the robot's description cannot
            state.
    """

    def __init__(
        self, robot: Robot, measurement: Measurement, kinds: Sequence[str], noise: Mapping[str, float]
    ) -> None:
        unsuited = next((kind for kind in kinds if kind in UNSUITED), None)
        if unsuited is not None:
            raise InputError(
                f"{unsuited} depends on more than the pose, or jumps with it",
                allowed=", ".join(term.kind for term in TERMS if term.kind not in UNSUITED),
            )
        self.robot, self.measurement = robot, measurement
        self.terms = [error_term(kind) for kind in kinds]
        self.setup: Setup = measurement.example
        self._sigma = np.array([noise[unit] for unit in measurement.units])
        q = random_positions(robot, REFERENCE, seed=0)
        model = self._model(q)
        for term in self.terms:
            missing = term.missing(robot, model.states[0])
            if missing:
                raise InputError(f"no design for {term.title}", remedy=f"it needs {missing}")
        parameters = model.parameters(self.setup)
        self._scale = np.array([item.scale for item in parameters])
        kinds_ = dict.fromkeys(["setup", *(item.kind for item in parameters)])
        groups = [[k for k, item in enumerate(parameters) if item.kind == kind] for kind in kinds_]
        rows = self._scaled(model)
        self.kept = list(reduce_columns(rows.reshape(-1, rows.shape[2]), groups).kept)
        self.parameters: tuple[ErrorParameter, ...] = tuple(parameters[k] for k in self.kept)

    @property
    def size(self) -> int:
        """Number of parameters that poses distinguish."""
        return len(self.kept)

    def rows(self, q: Array) -> Array:
        """Scaled rows of poses (N, r, L)."""
        return self._scaled(self._model(q))[:, :, self.kept]

    def symbolic(self) -> casadi.Function:
        """Writes the scaled rows of a pose as an expression: q (n,) -> (r, L)."""
        whole = symbolic_jacobian(self.robot, self.terms, self.measurement, self.setup)
        q = casadi.SX.sym("q", self.robot.n)
        scaled = casadi.diag(casadi.DM(1.0 / self._sigma)) @ whole(q) @ casadi.diag(casadi.DM(self._scale))
        return casadi.Function("rows", [q], [casadi.densify(scaled[:, self.kept])])

    def symbolic_flange(self) -> casadi.Function:
        """Writes the nominal flange of a pose as an expression: q (n,) -> (4, 4)."""
        arm = SymbolicArm(self.robot)
        return casadi.Function("flange", [arm.q], [arm.flange])

    def flange(self, q: Array) -> Array:
        """Nominal flange of poses (N, 4, 4)."""
        return self.robot.chain.flange(q)

    def seen(self, q: Array) -> NDArray[np.bool_]:
        """Says at which poses a nominal robot shows something to the instrument (N,)."""
        return np.asarray(np.isfinite(self.measurement.simulate([self.flange(q)], self.setup, {}, 0)).any(axis=1))

    def spread(self, information: Array) -> Array:
        """Standard errors of the parameters in SI units (L,), NaN without information.

        Args:
            information: sum of J'J of the poses (L, L).
        """
        values = np.linalg.eigvalsh(information)
        if values[0] <= 1e-12 * values[-1]:
            return np.full(self.size, np.nan)
        scale = np.array([item.scale for item in self.parameters])
        return np.sqrt(np.diag(np.linalg.inv(information))) * scale

    def prediction_error(self, information: Array, q: Array) -> float:
        """Expected error of predicted measurements, in the first unit: root mean square over poses.

        Args:
            information: of the poses that are measured (L, L).
            q: of those that are predicted (N, n).
        """
        rows = self.rows(q) * self._sigma[:, None]
        first = [unit == self.measurement.unit for unit in self.measurement.units]
        variance = np.einsum("nrl,lk,nrk->nr", rows, np.linalg.inv(information), rows)[:, first]
        return float(np.sqrt(variance.mean() * self.measurement.block))

    def _model(self, q: Array) -> GeometryModel:
        # What a nominal robot shows: derivatives of turns depend on how far they are off.
        observed = self.measurement.simulate([self.flange(q)], self.setup, {}, 0)
        return GeometryModel(
            [self.robot], self.terms, MeasuredPoses(q=q, measurement=self.measurement, observed=observed)
        )

    def _scaled(self, model: GeometryModel) -> Array:
        found = model.evaluate(np.zeros(len(model.errors)), self.setup)
        return found.jacobian * self._scale / self._sigma[:, None]
