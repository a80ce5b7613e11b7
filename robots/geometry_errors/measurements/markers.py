"""Markers on the flange or tool, whose positions a tracker measures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

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

if TYPE_CHECKING:
    import casadi


@dataclass(frozen=True, kw_only=True)
class Markers(Measurement):
    """``y_k = W (F m_k)``: positions [m] of one or several markers in the tracker's frame.

    Attributes:
        count: number of markers.
    """

    kind = "markers"
    title = "marker positions"
    block = 3
    count: int = 1

    @property
    def units(self) -> tuple[str, ...]:
        """Metres."""
        return ("m",) * (3 * self.count)

    @property
    def columns(self) -> tuple[str, ...]:
        """``x, y, z`` of one marker, ``x1, y1, z1, x2, ...`` of several."""
        if self.count == 1:
            return ("x", "y", "z")
        return tuple(f"{axis}{k + 1}" for k in range(self.count) for axis in "xyz")

    def start(self, flanges: Sequence[Array], observed: Array) -> Setup:
        """Registers the tracker by the marker that was seen most often, then places the others."""
        flange = flanges[0]
        points = observed.reshape(len(flange), self.count, 3)
        first = int(np.argmax(np.isfinite(points).all(axis=2).sum(axis=0)))
        pose, _ = registration(flange, points[:, first])
        turned, shift = pose[:3, :3], pose[:3, 3]
        setup = {"tracker": Unknown(kind="pose", value=pose)}
        for k in range(self.count):
            local = (points[:, k] - shift) @ turned - flange[:, :3, 3]
            seen = np.einsum("nij,ni->nj", flange[:, :3, :3], local)
            mean = np.nanmean(seen, axis=0) if np.isfinite(seen).any() else np.zeros(3)
            setup[f"marker_{k + 1}"] = Unknown(kind="point", value=mean)
        return setup

    def evaluate(self, flanges: Sequence[Array], observed: Array, setup: Setup) -> Evaluation:
        """Computes residuals [m] in the tracker's axes."""
        flange, tracker = flanges[0], setup["tracker"].value
        rows, size = len(flange), 3 * self.count
        turn = tracker[:3, :3] @ flange[:, :3, :3]
        residual, by_flange = np.empty((rows, size)), np.empty((rows, size, 6))
        parts: dict[str, Array] = {"tracker": np.empty((rows, size, 6))}
        for k in range(self.count):
            name, block = f"marker_{k + 1}", slice(3 * k, 3 * k + 3)
            marker = setup[name].value
            base = flange[:, :3, :3] @ marker + flange[:, :3, 3]
            residual[:, block] = observed[:, block] - base @ tracker[:3, :3].T - tracker[:3, 3]
            by_flange[:, block] = point_by_twist(turn, marker)
            parts["tracker"][:, block] = point_by_twist(tracker[:3, :3], base)
            parts[name] = np.zeros((rows, size, 3))
            parts[name][:, block] = turn
        return Evaluation(residual=residual, by_flange=(by_flange,), by_setup=setup_jacobian(setup, parts, rows, size))

    def expression(self, moved: Scene, nominal: Scene) -> casadi.SX:
        """Writes the positions in the tracker's frame."""
        import casadi

        flange, parts = moved
        seen = parts["tracker"] @ flange
        return casadi.vertcat(*(seen[:3, :3] @ parts[f"marker_{k + 1}"] + seen[:3, 3] for k in range(self.count)))

    def simulate(self, flanges: Sequence[Array], setup: Setup, noise: Mapping[str, float], seed: int) -> Array:
        """Gives positions (N, 3 count) [m]."""
        zero = np.zeros((len(flanges[0]), 3 * self.count))
        exact = -self.evaluate(flanges, zero, setup).residual
        return exact + noise.get("m", 0.0) * np.random.default_rng(seed).standard_normal(exact.shape)

    @property
    def example(self) -> Setup:
        """A tracker at the base; the first marker 0.1 m ahead of the flange, others around it at 0.1 m."""
        angles = 2.0 * np.pi * np.arange(self.count) / max(self.count, 1)
        places = np.column_stack([0.1 * np.cos(angles), 0.1 * np.sin(angles), np.full(self.count, 0.1)])
        places[0] = (0.05, 0.0, 0.1)
        markers = {f"marker_{k + 1}": Unknown(kind="point", value=place) for k, place in enumerate(places)}
        return {"tracker": Unknown(kind="pose", value=np.eye(4)), **markers}
