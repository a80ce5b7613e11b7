"""The information matrix of sampled motion, and its reverse mode."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy

import numpy as np

from robots.batch import batch_function
from robots.common.arrays import Array
from robots.regressor import TorqueModel


class Information:
    """G = Y'Y over samples and joints, and exact gradients of functions of G by the motion.

    The chain is regressor, Gram matrix, eigenvalues on the way there; on the way back dL/dY = 2 Y dL/dG goes through
    the reverse mode of the symbolic regressor. No finite differences.

    Args:
        model: the torque model.
        columns: indices of the m columns that will be fitted.
        rows: weights (n,) of the joints' rows; all alike by default.
    """

    def __init__(self, model: TorqueModel, columns: Sequence[int], rows: Array | None = None) -> None:
        self._rows = None if rows is None else np.asarray(rows, dtype=float)[:, None]
        self.size = len(columns)
        self._joints = model.robot.n
        self._forward = batch_function(model.symbolic(columns))
        self._reverse = batch_function(model.adjoint(columns))
        self._motion: tuple[Array, Array, Array] | None = None
        self._Y: Array | None = None

    def unshared(self) -> Information:
        """The same functions, with a memory of its own."""
        other = copy(self)
        other._motion = other._Y = None
        return other

    def gram(self, q: Array, dq: Array, ddq: Array) -> Array:
        """Evaluates Y'Y (m, m) on samples (N, n), and remembers them for `pullback`."""
        reusable = self._Y is not None and self._Y.shape[0] == q.shape[0]
        out = (self._Y,) if reusable and self._Y is not None else None
        (Y,) = self._forward(q, dq, ddq, out=out)
        if self._rows is not None:
            Y *= self._rows
        self._motion, self._Y = (q, dq, ddq), Y
        rows = Y.reshape(-1, self.size)
        return rows.T @ rows

    def pullback(self, weights: Array) -> tuple[Array, Array, Array]:
        """Turns dL/dG (m, m, symmetric) at the last `gram` into the gradients (N, n) of L by q, dq and ddq."""
        if self._motion is None or self._Y is None:
            raise RuntimeError("gram comes first")
        samples = self._Y.shape[0]
        adjoint = (self._Y.reshape(-1, self.size) @ (2 * weights)).reshape(samples, self._joints, -1)
        if self._rows is not None:
            adjoint *= self._rows
        q, dq, ddq = self._reverse(*self._motion, adjoint.reshape(samples, -1))
        shape = (samples, self._joints)
        return q.reshape(shape), dq.reshape(shape), ddq.reshape(shape)


def triangle(
    model: TorqueModel, columns: Sequence[int], q: Array, dq: Array, ddq: Array, rows: Array | None = None
) -> Array:
    """Reduces Y on samples (N, n) to a triangle R (m, m) with R'R = Y'WY; in chunks, by a QR of what came before.

    Squaring Y into Y'Y would lose singular values below 1e-8 of the largest.

    Args:
        model: the torque model.
        columns: indices of the m columns.
        q: positions (N, n).
        dq: velocities (N, n).
        ddq: accelerations (N, n).
        rows: weights (n,) of the joints' rows.
    """
    size = len(columns)
    reduced: Array = np.zeros((0, size))
    for start in range(0, len(q), 2000):
        chunk = slice(start, start + 2000)
        Y = model.regressor(q[chunk], dq[chunk], ddq[chunk], columns=columns)
        if rows is not None:
            Y *= np.asarray(rows)[:, None]
        reduced = np.asarray(np.linalg.qr(np.vstack([reduced, Y.reshape(-1, size)]), mode="r"), dtype=np.float64)
    return np.vstack([reduced, np.zeros((size - len(reduced), size))])


def singular_values(model: TorqueModel, columns: Sequence[int], q: Array, dq: Array, ddq: Array) -> Array:
    """Computes the singular values (m,) of Y on samples (N, n), ascending."""
    values = np.linalg.svd(triangle(model, columns, q, dq, ddq), compute_uv=False)
    return np.asarray(values[::-1], dtype=np.float64)
