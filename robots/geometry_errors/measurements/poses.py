"""Poses of a body on the flange or tool, as trackers with six degrees of freedom measure them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from robots.common.arrays import Array
from robots.geometry_errors.measurements.base import (
    Evaluation,
    Measurement,
    Scene,
    point_by_twist,
    registration,
    setup_jacobian,
)
from robots.geometry_errors.measurements.setup import Setup, Unknown
from robots.geometry_errors.twists import rotation_log_jacobian, rotation_vector

if TYPE_CHECKING:
    import casadi


@dataclass(frozen=True, kw_only=True)
class BodyPoses(Measurement):
    """``Y = W F X``: position [m] and unit quaternion x, y, z, w in the tracker's frame."""

    kind = "poses"
    title = "poses"
    block = 3

    @property
    def units(self) -> tuple[str, ...]:
        """Three metres and three radians."""
        return ("m",) * 3 + ("rad",) * 3

    @property
    def columns(self) -> tuple[str, ...]:
        """Position and quaternion."""
        return ("x", "y", "z", "qx", "qy", "qz", "qw")

    def start(self, flanges: Sequence[Array], observed: Array) -> Setup:
        """Registers the tracker by the positions, then averages the body's turn on the flange."""
        flange = flanges[0]
        tracker, marker = registration(flange, observed[:, :3])
        seen = np.isfinite(observed).all(axis=1)
        turns = np.swapaxes(tracker[:3, :3] @ flange[seen, :3, :3], 1, 2) @ _rotations(observed[seen])
        left, _, right = np.linalg.svd(turns.sum(axis=0))
        tool = np.eye(4)
        tool[:3, :3] = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
        tool[:3, 3] = marker
        return {"tracker": Unknown(kind="pose", value=tracker), "tool": Unknown(kind="pose", value=tool)}

    def evaluate(self, flanges: Sequence[Array], observed: Array, setup: Setup) -> Evaluation:
        """Computes residuals: positions in the tracker's axes [m], turns in the body's axes [rad]."""
        flange, tracker, tool = flanges[0], setup["tracker"].value, setup["tool"].value
        rows = len(flange)
        carried = flange @ tool
        predicted = tracker @ carried
        seen = np.isfinite(observed[:, 3:]).all(axis=1)
        turned = np.full((rows, 3), np.nan)
        turned[seen] = rotation_vector(np.swapaxes(predicted[seen, :3, :3], 1, 2) @ _rotations(observed[seen]))
        residual = np.hstack([observed[:, :3] - predicted[:, :3, 3], turned])
        log = rotation_log_jacobian(-np.nan_to_num(turned))
        by_flange, by_tracker, by_tool = (np.zeros((rows, 6, 6)) for _ in range(3))
        by_flange[:, :3] = point_by_twist(tracker[:3, :3] @ flange[:, :3, :3], tool[:3, 3])
        by_flange[:, 3:, 3:] = log @ tool[:3, :3].T
        by_tracker[:, :3] = point_by_twist(tracker[:3, :3], carried[:, :3, 3])
        by_tracker[:, 3:, 3:] = log @ np.swapaxes(carried[:, :3, :3], 1, 2)
        by_tool[:, :3, :3] = predicted[:, :3, :3]
        by_tool[:, 3:, 3:] = log
        parts = {"tracker": by_tracker, "tool": by_tool}
        return Evaluation(residual=residual, by_flange=(by_flange,), by_setup=setup_jacobian(setup, parts, rows, 6))

    def expression(self, moved: Scene, nominal: Scene) -> casadi.SX:
        """Writes the position, and the turn from the nominal pose."""
        import casadi

        pose, before = (parts["tracker"] @ flange @ parts["tool"] for flange, parts in (moved, nominal))
        return casadi.vertcat(pose[:3, 3], casadi.inv_skew(before[:3, :3].T @ pose[:3, :3]))

    def simulate(self, flanges: Sequence[Array], setup: Setup, noise: Mapping[str, float], seed: int) -> Array:
        """Gives positions and quaternions (N, 7)."""
        rng = np.random.default_rng(seed)
        poses = setup["tracker"].value @ flanges[0] @ setup["tool"].value
        error = Rotation.from_rotvec(noise.get("rad", 0.0) * rng.standard_normal((len(poses), 3)))
        places = poses[:, :3, 3] + noise.get("m", 0.0) * rng.standard_normal((len(poses), 3))
        return np.hstack([places, (Rotation.from_matrix(poses[:, :3, :3]) * error).as_quat()])

    @property
    def example(self) -> Setup:
        """A tracker at the base, and a body 0.1 m ahead of the flange."""
        tool = np.eye(4)
        tool[:3, 3] = (0.05, 0.0, 0.1)
        return {"tracker": Unknown(kind="pose", value=np.eye(4)), "tool": Unknown(kind="pose", value=tool)}


def _rotations(observed: Array) -> Array:
    return np.asarray(Rotation.from_quat(observed[:, 3:]).as_matrix())
