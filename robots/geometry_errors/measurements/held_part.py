"""A part that both arms of a robot hold: their flanges keep one pose to each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robots.common.arrays import Array
from robots.geometry_errors.measurements.base import Evaluation, Measurement, setup_jacobian
from robots.geometry_errors.measurements.setup import Setup, Unknown
from robots.geometry_errors.twists import adjoint, cross_matrix, inverse, rotation_log_jacobian, rotation_vector


@dataclass(frozen=True, kw_only=True)
class HeldPart(Measurement):
    """``F_1 X = Z F_2``: X is the second flange in the first one's frame, Z the second base in the first one's."""

    kind = "held_part"
    title = "a part held by both arms"
    block = 3
    arms = 2

    @property
    def units(self) -> tuple[str, ...]:
        """Three metres and three radians."""
        return ("m",) * 3 + ("rad",) * 3

    @property
    def columns(self) -> tuple[str, ...]:
        """Nothing beside the joints of both arms."""
        return ()

    def start(self, flanges: Sequence[Array], observed: Array) -> Setup:
        """Solves ``A X = Z B`` for the turns by the largest singular vector, then for the shifts (Shah 2013)."""
        first, second = flanges
        total = np.zeros((9, 9))
        for a, b in zip(first[:, :3, :3], second[:, :3, :3], strict=True):
            total += np.kron(b, a)
        left, _, right = np.linalg.svd(total)
        # vec(Z) is total vec(X) up to scale.
        turns = []
        for vector in (left[:, 0], right[0]):
            matrix = vector.reshape(3, 3, order="F")
            matrix = matrix * np.sign(np.linalg.det(matrix))
            u, _, v = np.linalg.svd(matrix)
            turns.append(u @ v)
        z, x = np.eye(4), np.eye(4)
        z[:3, :3], x[:3, :3] = turns
        rows = np.concatenate([first[:, :3, :3], np.tile(-np.eye(3), (len(first), 1, 1))], axis=2)
        target = second[:, :3, 3] @ turns[0].T - first[:, :3, 3]
        found = np.linalg.lstsq(rows.reshape(-1, 6), target.ravel(), rcond=1e-9)[0]
        x[:3, 3], z[:3, 3] = found[:3], found[3:]
        return {"part": Unknown(kind="pose", value=x), "second_base": Unknown(kind="pose", value=z)}

    def evaluate(self, flanges: Sequence[Array], observed: Array, setup: Setup) -> Evaluation:
        """Computes how far the held part is from where both arms say [m, rad], in its own axes."""
        first, second = flanges
        part, base = setup["part"].value, setup["second_base"].value
        rows = len(first)
        gap = inverse(first @ part) @ (base @ second)
        turned = rotation_vector(gap[:, :3, :3])
        before, after = rotation_log_jacobian(-turned), rotation_log_jacobian(turned)
        # The gap moves by exp(-xi) from the left, and by exp(xi) from the right.
        by_left, by_right = np.zeros((rows, 6, 6)), np.zeros((rows, 6, 6))
        by_left[:, :3, :3] = -np.eye(3)
        by_left[:, :3, 3:] = cross_matrix(gap[:, :3, 3])
        by_left[:, 3:, 3:] = -before
        by_right[:, :3, :3] = gap[:, :3, :3]
        by_right[:, 3:, 3:] = after
        parts = {"part": by_left, "second_base": by_right @ adjoint(inverse(second))}
        return Evaluation(
            residual=-np.hstack([gap[:, :3, 3], turned]),
            by_flange=(by_left @ adjoint(inverse(part)), by_right),
            by_setup=setup_jacobian(setup, parts, rows, 6),
        )
