"""Normal equations per joint: all that least squares needs of a log, however long it is."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from estimation.pulls import Pull

Array = NDArray[np.float64]

# Keeps a matrix invertible that no ridge helps.
FAINT = 1e-12


@dataclass(frozen=True)
class Moments:
    """Sums over samples, joint by joint.

    Attributes:
        gram: (n, p, p), Y_j' Y_j.
        cross: (n, p), Y_j' tau_j.
        square: (n,), tau_j' tau_j.
        count: (n,), rows.
        pull: what the ridge of `solve` pulls to; without, to zero.
    """

    gram: Array
    cross: Array
    square: Array
    count: Array
    pull: Pull | None = None

    @staticmethod
    def of(Y: Array, tau: Array, mask: Array) -> Moments:
        """Sums the rows of Y (N, n, p) and tau (N, n) where the mask (N, n) is one."""
        n, p = Y.shape[1:]
        gram, cross = np.zeros((n, p, p)), np.zeros((n, p))
        for joint in range(n):
            # Most columns do not act on a joint: links before it, friction of others.
            used = np.flatnonzero(Y[:, joint].any(axis=0))
            rows = Y[:, joint][:, used] * mask[:, joint, None]
            gram[joint][np.ix_(used, used)] = rows.T @ rows
            cross[joint, used] = rows.T @ tau[:, joint]
        return Moments(gram, cross, (mask * tau**2).sum(axis=0), mask.sum(axis=0))

    def __add__(self, other: Moments) -> Moments:
        return replace(
            self,
            gram=self.gram + other.gram,
            cross=self.cross + other.cross,
            square=self.square + other.square,
            count=self.count + other.count,
        )

    def __sub__(self, other: Moments) -> Moments:
        return replace(
            self,
            gram=self.gram - other.gram,
            cross=self.cross - other.cross,
            square=self.square - other.square,
            count=self.count - other.count,
        )

    def pulled(self, pull: Pull | None) -> Moments:
        """Gives the same sums with another pull."""
        return replace(self, pull=pull)

    def columns(self, chosen: NDArray[np.intp]) -> Moments:
        """Keeps some of the p columns."""
        pull = None if self.pull is None else self.pull.columns(chosen)
        return Moments(self.gram[:, chosen][:, :, chosen], self.cross[:, chosen], self.square, self.count, pull)

    def solve(self, weights: Array, ridge: float) -> Array:
        """Solves for parameters (p,).

        Args:
            weights: of each joint's rows (n,).
            ridge: how much the pull counts. Without a pull it is added to the diagonal of the weighted Gram matrix
                once its columns have unit length; with one, a ridge of 1 weighs an error of a parameter's own size
                as much as all of the torque.
        """
        scale, matrix = self._scaled(weights)
        right = (weights @ self.cross) / scale
        if self.pull is None:
            matrix = matrix + ridge * np.eye(len(scale))
        else:
            precision = ridge * (weights @ self.square) * self.pull.precision
            matrix = matrix + precision / scale[:, None] / scale + FAINT * np.eye(len(scale))
            right = right + (precision @ self.pull.target) / scale + FAINT * scale * self.pull.target
        return cho_solve(cho_factor(matrix), right) / scale

    def inverse(self, weights: Array, ridge: float) -> Array:
        """Inverts the weighted Gram matrix (p, p) with the ridge of `solve`."""
        scale, matrix = self._scaled(weights)
        inverse = cho_solve(cho_factor(matrix + ridge * np.eye(len(scale))), np.eye(len(scale)))
        return inverse / scale[:, None] / scale

    def _scaled(self, weights: Array) -> tuple[Array, Array]:
        matrix = np.tensordot(weights, self.gram, axes=1)
        scale = np.sqrt(np.diag(matrix))
        scale = np.where(scale > 0, scale, 1.0)
        return scale, matrix / scale[:, None] / scale

    def residual(self, parameters: Array) -> Array:
        """Sums each joint's squared residuals (n,)."""
        quadratic = np.einsum("p,jpq,q->j", parameters, self.gram, parameters, optimize=True)
        return np.maximum(self.square - 2 * self.cross @ parameters + quadratic, 0.0)

    def level(self, parameters: Array) -> Array:
        """Gives each joint's residual RMS (n,) [N m or N], floored where a fit is exact."""
        rows = np.maximum(self.count, 1)
        floor = 1e-6 * self.square / rows
        return np.sqrt(np.maximum(self.residual(parameters) / rows, np.maximum(floor, np.finfo(float).tiny)))
