"""Distances from fixed anchors to a point on the tool, by a ball bar or draw wires."""

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
    setup_jacobian,
)
from robots.geometry_errors.measurements.setup import Setup, Unknown

if TYPE_CHECKING:
    import casadi


@dataclass(frozen=True, kw_only=True)
class Distances(Measurement):
    """``d_k = |F m - c_k| + offset_k`` [m]: one or several anchors c in the base frame, one point m on the flange.

    Attributes:
        count: number of anchors.
        offset: whether the instrument's zero is estimated, too: a draw wire has one, a ball bar of known length not.
    """

    kind = "distances"
    title = "distances"
    block = 1
    count: int = 1
    offset: bool = False

    @property
    def units(self) -> tuple[str, ...]:
        """Metres."""
        return ("m",) * self.count

    @property
    def columns(self) -> tuple[str, ...]:
        """``d`` of one anchor, ``d1, d2, ...`` of several."""
        return ("d",) if self.count == 1 else tuple(f"d{k + 1}" for k in range(self.count))

    def start(self, flanges: Sequence[Array], observed: Array) -> Setup:
        """Trilaterates each anchor from the flange's positions: ``d^2 - p^2 = -2 p c + c^2`` is linear."""
        places = flanges[0][:, :3, 3]
        setup = {"tool": Unknown(kind="point", value=np.zeros(3))}
        for k in range(self.count):
            seen = np.isfinite(observed[:, k])
            p, d = places[seen], observed[seen, k]
            rows = np.column_stack([-2.0 * (p - places.mean(0)), np.ones(len(p))])
            target = d**2 - np.sum((p - places.mean(0)) ** 2, axis=1)
            found = np.linalg.lstsq(rows, target, rcond=1e-6)[0][:3] + places.mean(0)
            setup[f"anchor_{k + 1}"] = Unknown(kind="point", value=found)
            if self.offset:
                setup[f"offset_{k + 1}"] = Unknown(kind="number", value=np.zeros(1))
        return setup

    def evaluate(self, flanges: Sequence[Array], observed: Array, setup: Setup) -> Evaluation:
        """Computes residuals [m]."""
        flange, tool = flanges[0], setup["tool"].value
        rows = len(flange)
        place = flange[:, :3, :3] @ tool + flange[:, :3, 3]
        by_twist = point_by_twist(flange[:, :3, :3], tool)
        residual, by_flange = np.empty((rows, self.count)), np.empty((rows, self.count, 6))
        parts: dict[str, Array] = {"tool": np.empty((rows, self.count, 3))}
        for k in range(self.count):
            along = place - setup[f"anchor_{k + 1}"].value
            length = np.linalg.norm(along, axis=1)
            unit = along / np.maximum(length, np.finfo(float).tiny)[:, None]
            zero = float(setup[f"offset_{k + 1}"].value[0]) if self.offset else 0.0
            residual[:, k] = observed[:, k] - length - zero
            by_flange[:, k] = np.einsum("ni,nij->nj", unit, by_twist)
            parts["tool"][:, k] = by_flange[:, k, :3]
            parts[f"anchor_{k + 1}"] = np.zeros((rows, self.count, 3))
            parts[f"anchor_{k + 1}"][:, k] = -unit
            if self.offset:
                parts[f"offset_{k + 1}"] = np.zeros((rows, self.count, 1))
                parts[f"offset_{k + 1}"][:, k] = 1.0
        return Evaluation(
            residual=residual, by_flange=(by_flange,), by_setup=setup_jacobian(setup, parts, rows, self.count)
        )

    def expression(self, moved: Scene, nominal: Scene) -> casadi.SX:
        """Writes the distances; the instrument's zero adds to them."""
        import casadi

        flange, parts = moved
        place = flange[:3, :3] @ parts["tool"] + flange[:3, 3]
        zeros = [parts[f"offset_{k + 1}"] if self.offset else casadi.SX(0.0) for k in range(self.count)]
        return casadi.vertcat(*(casadi.norm_2(place - parts[f"anchor_{k + 1}"]) + zero for k, zero in enumerate(zeros)))

    def simulate(self, flanges: Sequence[Array], setup: Setup, noise: Mapping[str, float], seed: int) -> Array:
        """Gives distances (N, count) [m]."""
        exact = -self.evaluate(flanges, np.zeros((len(flanges[0]), self.count)), setup).residual
        return exact + noise.get("m", 0.0) * np.random.default_rng(seed).standard_normal(exact.shape)

    @property
    def example(self) -> Setup:
        """Anchors on a circle of 1 m on the floor around the base, and a point 0.1 m ahead of the flange."""
        setup = {"tool": Unknown(kind="point", value=np.array([0.05, 0.0, 0.1]))}
        for k in range(self.count):
            angle = 2.0 * np.pi * k / self.count + 0.3
            place = np.array([np.cos(angle), np.sin(angle), 0.1 * k])
            setup[f"anchor_{k + 1}"] = Unknown(kind="point", value=place)
            if self.offset:
                setup[f"offset_{k + 1}"] = Unknown(kind="number", value=np.zeros(1))
        return setup
