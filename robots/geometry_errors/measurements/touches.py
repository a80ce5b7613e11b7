"""Touches: the tool's tip was brought to planes, or to points, that do not move."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robots.common.arrays import Array
from robots.geometry_errors.measurements.base import Evaluation, Measurement, point_by_twist, setup_jacobian
from robots.geometry_errors.measurements.setup import Setup, Unknown, tangents


def _tip(flange: Array, setup: Setup) -> tuple[Array, Array]:
    """The tip in the base frame (N, 3), and its derivative by the flange's twist (N, 3, 6)."""
    tool = setup["tool"].value
    return flange[:, :3, :3] @ tool + flange[:, :3, 3], point_by_twist(flange[:, :3, :3], tool)


@dataclass(frozen=True, kw_only=True)
class Planes(Measurement):
    """``n_k (F m) = h_k``: the tip touches plane k, whose normal and distance are estimated.

    Attributes:
        count: number of planes.
    """

    kind = "planes"
    title = "touched planes"
    block = 1
    count: int = 1

    @property
    def units(self) -> tuple[str, ...]:
        """Metres."""
        return ("m",)

    @property
    def columns(self) -> tuple[str, ...]:
        """The number of the plane, from 1."""
        return ("plane",)

    def start(self, flanges: Sequence[Array], observed: Array) -> Setup:
        """Lays planes through the flange's positions."""
        setup = {"tool": Unknown(kind="point", value=np.zeros(3))}
        for k in range(1, self.count + 1):
            places = flanges[0][observed[:, 0] == k, :3, 3]
            centre = places.mean(0)
            normal = np.linalg.svd(places - centre)[2][-1]
            setup[f"normal_{k}"] = Unknown(kind="direction", value=normal)
            setup[f"height_{k}"] = Unknown(kind="number", value=np.array([normal @ centre]))
        return setup

    def evaluate(self, flanges: Sequence[Array], observed: Array, setup: Setup) -> Evaluation:
        """Computes distances from the planes [m]."""
        flange = flanges[0]
        rows = len(flange)
        tip, by_twist = _tip(flange, setup)
        number = observed[:, 0]
        normals = np.array([setup[f"normal_{k}"].value for k in range(1, self.count + 1)])
        heights = np.array([setup[f"height_{k}"].value[0] for k in range(1, self.count + 1)])
        own = np.nan_to_num(number, nan=1.0).astype(int) - 1
        normal = normals[own]
        residual = np.where(np.isfinite(number), heights[own] - np.sum(normal * tip, axis=1), np.nan)
        by_flange = np.einsum("ni,nij->nj", normal, by_twist)[:, None, :]
        parts: dict[str, Array] = {"tool": by_flange[..., :3]}
        for k in range(1, self.count + 1):
            mine = (own == k - 1)[:, None, None]
            parts[f"normal_{k}"] = mine * (tip @ tangents(normals[k - 1]))[:, None, :]
            parts[f"height_{k}"] = -1.0 * mine * np.ones((rows, 1, 1))
        return Evaluation(
            residual=residual[:, None], by_flange=(by_flange,), by_setup=setup_jacobian(setup, parts, rows, 1)
        )


@dataclass(frozen=True, kw_only=True)
class Points(Measurement):
    """``F m = c_k``: the tip touches point k from several directions.

    Attributes:
        count: number of points.
    """

    kind = "points"
    title = "touched points"
    block = 3
    count: int = 1

    @property
    def units(self) -> tuple[str, ...]:
        """Metres."""
        return ("m",) * 3

    @property
    def columns(self) -> tuple[str, ...]:
        """The number of the point, from 1."""
        return ("point",)

    def start(self, flanges: Sequence[Array], observed: Array) -> Setup:
        """Finds the tip by which each point is touched at one place: ``R m - c_k = -p`` is linear."""
        flange, own = flanges[0], observed[:, 0].astype(int) - 1
        rows = np.zeros((len(flange), 3, 3 + 3 * self.count))
        rows[:, :, :3] = flange[:, :3, :3]
        for axis in range(3):
            rows[np.arange(len(flange)), axis, 3 + 3 * own + axis] = -1.0
        solved = np.linalg.lstsq(rows.reshape(-1, rows.shape[2]), -flange[:, :3, 3].ravel(), rcond=1e-9)[0]
        found: Array = np.asarray(solved, dtype=np.float64)
        points = {
            f"point_{k + 1}": Unknown(kind="point", value=found[3 + 3 * k : 6 + 3 * k]) for k in range(self.count)
        }
        return {"tool": Unknown(kind="point", value=found[:3]), **points}

    def evaluate(self, flanges: Sequence[Array], observed: Array, setup: Setup) -> Evaluation:
        """Computes the tip's distance from the point in the base frame [m]."""
        flange = flanges[0]
        rows = len(flange)
        tip, by_twist = _tip(flange, setup)
        own = np.nan_to_num(observed[:, 0], nan=1.0).astype(int) - 1
        points = np.array([setup[f"point_{k + 1}"].value for k in range(self.count)])
        residual = np.where(np.isfinite(observed), points[own] - tip, np.nan)
        parts: dict[str, Array] = {"tool": by_twist[..., :3]}
        for k in range(self.count):
            parts[f"point_{k + 1}"] = -1.0 * (own == k)[:, None, None] * np.eye(3)
        return Evaluation(residual=residual, by_flange=(by_twist,), by_setup=setup_jacobian(setup, parts, rows, 3))
