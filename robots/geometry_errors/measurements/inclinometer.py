"""An inclinometer on the flange or tool: two angles to the vertical."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from robots.common.arrays import Array
from robots.geometry_errors.measurements.base import Evaluation, Measurement, Scene, setup_jacobian
from robots.geometry_errors.measurements.setup import Setup, Unknown, tangents
from robots.geometry_errors.twists import cross_matrix

if TYPE_CHECKING:
    import casadi


@dataclass(frozen=True, kw_only=True)
class Inclinometer(Measurement):
    """``s = S' R' up``: roll is ``atan2(s_y, s_z)``, pitch ``atan2(-s_x, |s_y, s_z|)`` [rad].

    S is the sensor's turn on the flange, ``up`` the vertical in the base frame: both are estimated.

    Attributes:
        up: nominal vertical in the base frame.
    """

    kind = "inclinometer"
    title = "an inclinometer"
    block = 2
    up: tuple[float, float, float] = (0.0, 0.0, 1.0)

    @property
    def units(self) -> tuple[str, ...]:
        """Two radians."""
        return ("rad", "rad")

    @property
    def columns(self) -> tuple[str, ...]:
        """Roll and pitch."""
        return ("roll", "pitch")

    def start(self, flanges: Sequence[Array], observed: Array) -> Setup:
        """Turns the sensor so that it sees the nominal vertical (Kabsch 1976)."""
        seen = np.isfinite(observed).all(axis=1)
        roll, pitch = observed[seen].T
        sensed = np.column_stack([-np.sin(pitch), np.sin(roll) * np.cos(pitch), np.cos(roll) * np.cos(pitch)])
        vertical = np.swapaxes(flanges[0][seen, :3, :3], 1, 2) @ np.asarray(self.up)
        left, _, right = np.linalg.svd(vertical.T @ sensed)
        turn = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
        return {
            "up": Unknown(kind="direction", value=np.asarray(self.up, dtype=float)),
            "sensor": Unknown(kind="rotation", value=turn),
        }

    def evaluate(self, flanges: Sequence[Array], observed: Array, setup: Setup) -> Evaluation:
        """Computes residuals [rad]."""
        turn, sensor, up = flanges[0][:, :3, :3], setup["sensor"].value, setup["up"].value
        rows = len(turn)
        back = np.swapaxes(turn, 1, 2)
        vertical = back @ up
        x, y, z = (vertical @ sensor).T
        across = np.maximum(np.hypot(y, z), 1e-9)
        predicted = np.column_stack([np.arctan2(y, z), np.arctan2(-x, across)])
        by_sensed = np.zeros((rows, 2, 3))
        by_sensed[:, 0, 1], by_sensed[:, 0, 2] = z / across**2, -y / across**2
        by_sensed[:, 1, 0] = -across
        by_sensed[:, 1, 1], by_sensed[:, 1, 2] = x * y / across, x * z / across
        by_flange = np.zeros((rows, 2, 6))
        by_flange[:, :, 3:] = by_sensed @ sensor.T @ cross_matrix(vertical)
        parts = {
            "up": by_sensed @ sensor.T @ back @ tangents(up),
            "sensor": by_sensed @ cross_matrix(np.column_stack([x, y, z])),
        }
        difference = (observed - predicted + np.pi) % (2.0 * np.pi) - np.pi
        return Evaluation(residual=difference, by_flange=(by_flange,), by_setup=setup_jacobian(setup, parts, rows, 2))

    def expression(self, moved: Scene, nominal: Scene) -> casadi.SX:
        """Writes roll and pitch."""
        import casadi

        flange, parts = moved
        sensed = parts["sensor"].T @ flange[:3, :3].T @ parts["up"]
        across = casadi.sqrt(sensed[1] ** 2 + sensed[2] ** 2)
        return casadi.vertcat(casadi.atan2(sensed[1], sensed[2]), casadi.atan2(-sensed[0], across))

    def simulate(self, flanges: Sequence[Array], setup: Setup, noise: Mapping[str, float], seed: int) -> Array:
        """Gives roll and pitch (N, 2) [rad]."""
        zero = np.zeros((len(flanges[0]), 2))
        exact = -self.evaluate(flanges, zero, setup).residual
        return exact + noise.get("rad", 0.0) * np.random.default_rng(seed).standard_normal(exact.shape)

    @property
    def example(self) -> Setup:
        """A sensor in the axes of the flange."""
        return {
            "up": Unknown(kind="direction", value=np.asarray(self.up, dtype=float)),
            "sensor": Unknown(kind="rotation", value=np.eye(3)),
        }
