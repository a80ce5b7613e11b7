"""What all measurements of a flange have in common: a residual, and its derivatives."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, TypeAlias

import numpy as np

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.geometry_errors.measurements.setup import Setup
from robots.geometry_errors.twists import cross_matrix

if TYPE_CHECKING:
    import casadi

Scene: TypeAlias = "tuple[casadi.SX, Mapping[str, casadi.SX]]"
"""Pose of the flange (4, 4), and the parts of the setup by name, as expressions."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Evaluation:
    """A measurement at N poses, r numbers each.

    Attributes:
        residual: measured minus predicted (N, r); NaN where nothing was measured.
        by_flange: derivative of the prediction by the twist of each arm's flange, (N, r, 6) per arm.
        by_setup: derivative by the parameters of all that is estimated (N, r, K).
    """

    residual: Array
    by_flange: tuple[Array, ...]
    by_setup: Array


class Measurement(ABC):
    """A kind of measurement.

    Attributes:
        kind: its name in files.
        title: its name for people.
        arms: number of arms that take part.
        block: how many numbers of the first unit make a point: 3 of a position, 1 of a distance.
    """

    kind: ClassVar[str]
    title: ClassVar[str]
    arms: ClassVar[int] = 1
    block: ClassVar[int] = 1

    @property
    @abstractmethod
    def units(self) -> tuple[str, ...]:
        """Unit of each of the r numbers: "m", "rad" or "px"."""

    @property
    @abstractmethod
    def columns(self) -> tuple[str, ...]:
        """Names of the c numbers of a pose in a table."""

    @property
    def unit(self) -> str:
        """Unit of the error that people look at first: that of the first numbers."""
        return self.units[0]

    def error(self, residual: Array) -> Array:
        """Error of each pose (N,): root mean square distance of its points in the first unit; NaN if none was seen.

        Args:
            residual: (N, r).
        """
        first = residual[:, [unit == self.unit for unit in self.units]]
        points = np.isfinite(first).sum(axis=1) / self.block
        return np.asarray(np.sqrt(np.nansum(first**2, axis=1) / np.where(points > 0, points, np.nan)))

    def shift(self, residual: Array) -> Array:
        """Mean signed error of each pose's points by axis (N, block) in the first unit; NaN if none was seen.

        Args:
            residual: (N, r).
        """
        first = residual[:, [unit == self.unit for unit in self.units]].reshape(len(residual), -1, self.block)
        count = np.isfinite(first).sum(axis=1)
        return np.asarray(np.nansum(first, axis=1) / np.where(count > 0, count, np.nan))

    @abstractmethod
    def start(self, flanges: Sequence[Array], observed: Array) -> Setup:
        """Finds a first setup from nominal flanges.

        Args:
            flanges: (N, 4, 4) per arm.
            observed: what was measured (N, c).
        """

    @abstractmethod
    def evaluate(self, flanges: Sequence[Array], observed: Array, setup: Setup) -> Evaluation:
        """Computes residuals and derivatives.

        Args:
            flanges: (N, 4, 4) per arm.
            observed: what was measured (N, c).
            setup: where instruments and markers are.
        """

    def expression(self, moved: Scene, nominal: Scene) -> casadi.SX:
        """Writes what is measured (r,); its derivatives count where the moved scene is the nominal one.

        Args:
            moved: scene with small steps.
            nominal: the same without.

        Raises:
            InputError: a measurement for which no poses are designed.
        """
        raise InputError(f"no poses are designed for {self.title}", remedy="choose another kind of measurement")

    def simulate(self, flanges: Sequence[Array], setup: Setup, noise: Mapping[str, float], seed: int) -> Array:
        """Measures flanges (N, c).

        Args:
            flanges: (N, 4, 4) per arm.
            setup: where instruments and markers are.
            noise: standard deviation by unit.
            seed: of the noise.

        Raises:
            InputError: a measurement that only poses of a special kind have, such as those that touch a plane.
        """
        raise InputError(f"{self.title} cannot be simulated at any pose", remedy="choose another kind of measurement")

    @property
    def example(self) -> Setup:
        """A usual setup, for designs."""
        raise InputError(f"no poses are designed for {self.title}", remedy="choose another kind of measurement")


def point_by_twist(rotation: Array, point: Array) -> Array:
    """Derivative of a point in a frame by the frame's twist: ``R [1, -[p]]``.

    Args:
        rotation: of the frame (..., 3, 3).
        point: in the frame (..., 3).

    Returns:
        (..., 3, 6).
    """
    shape = np.broadcast_shapes(rotation.shape[:-2], point.shape[:-1])
    result = np.empty((*shape, 3, 6))
    result[..., :3] = rotation
    result[..., 3:] = -rotation @ cross_matrix(point)
    return result


def setup_jacobian(setup: Setup, parts: Mapping[str, Array], rows: int, size: int) -> Array:
    """Puts the derivatives by the parts of a setup together (N, r, K); parts without derivative are zero."""
    blocks = [
        np.broadcast_to(parts[name], (rows, size, part.size)) if name in parts else np.zeros((rows, size, part.size))
        for name, part in setup.items()
        if not part.known
    ]
    return np.concatenate(blocks, axis=2) if blocks else np.zeros((rows, size, 0))


def affine_fit(flange: Array, points: Array) -> tuple[Array, Array, Array]:
    """Fits ``A y + s = p + R m`` to flanges and one measured point of each, without starting values.

    A is the inverse of the tracker's rotation, times the unit of the measurement: its singular values show another
    unit, its determinant a left-handed frame.

    Args:
        flange: (N, 4, 4).
        points: (N, 3), NaN where nothing was measured.

    Returns:
        A (3, 3), s (3,), m (3,).
    """
    seen = np.isfinite(points).all(axis=1)
    flange, points = flange[seen], points[seen]
    # Centred, so that s drops out.
    y, p, turn = points - points.mean(0), flange[:, :3, 3], flange[:, :3, :3]
    p0, turn0 = p.mean(0), turn.mean(0)
    rows = np.zeros((len(y), 3, 12))
    for axis in range(3):
        rows[:, axis, 3 * axis : 3 * axis + 3] = y
    rows[:, :, 9:] = turn0 - turn
    scale = float(np.linalg.norm(y)) or 1.0
    rows[:, :, :9] /= scale
    solution = np.linalg.lstsq(rows.reshape(-1, 12), (p - p0).ravel(), rcond=1e-9)[0]
    affine, m = solution[:9].reshape(3, 3) / scale, solution[9:]
    return affine, p0 + turn0 @ m - affine @ points.mean(0), m


def registration(flange: Array, points: Array) -> tuple[Array, Array]:
    """Finds the tracker's pose of the base frame and the marker on the flange from nominal flanges.

    Args:
        flange: (N, 4, 4).
        points: (N, 3) [m], NaN where nothing was measured.

    Returns:
        (4, 4), (3,) [m].
    """
    seen = np.isfinite(points).all(axis=1)
    affine, _, marker = affine_fit(flange, points)
    left, _, right = np.linalg.svd(affine.T)
    rotation = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
    pose = np.eye(4)
    for _ in range(20):
        base = flange[seen][:, :3, :3] @ marker + flange[seen][:, :3, 3]
        y = points[seen]
        spread = (y - y.mean(0)).T @ (base - base.mean(0))
        left, _, right = np.linalg.svd(spread)
        rotation = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
        pose[:3, :3], pose[:3, 3] = rotation, y.mean(0) - rotation @ base.mean(0)
        # The marker that fits best for this pose of the tracker: the mean of where the flange sees it.
        local = (y - pose[:3, 3]) @ rotation - flange[seen][:, :3, 3]
        found = np.einsum("nij,ni->j", flange[seen][:, :3, :3], local) / len(y)
        if np.linalg.norm(found - marker) < 1e-9:
            break
        marker = found
    return pose, marker
