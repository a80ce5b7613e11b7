"""Normal equations per joint: all that least squares needs of a log, however long it is."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimation.linear_algebra.positive import solve_nearly_positive, solve_positive
from estimation.linear_algebra.scaled import LEAST_RIDGE, inverse_root, lengths
from estimation.regressions.parameter_priors import GaussianPrior
from robots.common.arrays import Array


@dataclass(frozen=True)
class Moments:
    """Sums over samples, joint by joint.

    Attributes:
        gram: (n, p, p), Y_j' Y_j.
        cross: (n, p), Y_j' tau_j.
        square: (n,), tau_j' tau_j.
        count: (n,), rows.
        pull: what the ridge of `solve` pulls to; without, to zero. `posterior` takes it as it is, and it may be one of
            the first columns only.
    """

    gram: Array
    cross: Array
    square: Array
    count: Array
    pull: GaussianPrior | None = None

    @staticmethod
    def of(Y: Array, tau: Array, weights: Array | None = None) -> Moments:
        """Sums the rows of Y (N, n, p) and tau (N, n), times weights (N, n); rows of weight zero do not count."""
        n, p = Y.shape[1:]
        gram, cross = np.zeros((n, p, p)), np.zeros((n, p))
        weighted = tau if weights is None else weights * tau
        for joint in range(n):
            # Most columns do not act on a joint: links before it, friction of others.
            used = np.flatnonzero(Y[:, joint].any(axis=0))
            rows = Y[:, joint] if len(used) == p else Y[:, joint][:, used]
            rows = rows if weights is None else rows * weights[:, joint, None]
            gram[joint][np.ix_(used, used)] = rows.T @ rows
            cross[joint, used] = rows.T @ weighted[:, joint]
        count = np.full(n, len(tau)) if weights is None else np.count_nonzero(weights, axis=0)
        return Moments(gram, cross, (weighted**2).sum(axis=0), count)

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

    def joined(self, weights: Array | None = None) -> Moments:
        """Sums over the joints, their squared rows times weights (n,); gives the sums of one joint."""
        own = np.ones(len(self.gram)) if weights is None else weights
        sums = self._weighted(own)[None], (own @ self.cross)[None], np.array([own @ self.square])
        return Moments(*sums, np.array([self.count.sum()]), self.pull)

    def pulled(self, pull: GaussianPrior | None) -> Moments:
        """Gives the same sums with another prior."""
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
        gram, cross = self._weighted(weights), weights @ self.cross
        return solve_all(gram[None], cross[None], np.array([weights @ self.square]), ridge, self.pull)[0]

    def inverse(self, weights: Array, ridge: float) -> Array:
        """Inverts the matrix (p, p) by which `solve` finds the parameters."""
        matrix, extra = self._weighted(weights), ridge
        if self.pull is not None:
            matrix, extra = matrix + ridge * float(weights @ self.square) * self.pull.precision, LEAST_RIDGE
        scale, unit = lengths(matrix), np.eye(len(matrix))
        inverse = solve_positive(matrix / scale[:, None] / scale + extra * unit, unit)
        return np.asarray(inverse / scale[:, None] / scale)

    def posterior(self) -> Array:
        """Finds the parameters (p,) of largest posterior density, all rows of unit variance.

        Directions that neither data nor prior determine are zero, as in the least-norm solution.
        """
        root, aim = self._information()
        return np.asarray(root @ (root.T @ aim))

    def explained(self) -> float:
        """Gives the squares that `posterior` explains, minus the penalty of the prior."""
        root, aim = self._information()
        projected = root.T @ aim
        penalty = 0.0 if self.pull is None else self.pull.target @ self.pull.precision @ self.pull.target
        return float(projected @ projected - penalty)

    def _information(self) -> tuple[Array, Array]:
        """The root of the inverse Gram matrix with the prior, and the right-hand side."""
        gram, cross = self.gram.sum(axis=0), self.cross.sum(axis=0)
        if self.pull is not None:
            known = len(self.pull.target)
            gram[:known, :known] += self.pull.precision
            cross[:known] += self.pull.precision @ self.pull.target
        return inverse_root(gram, LEAST_RIDGE), cross

    def _weighted(self, weights: Array) -> Array:
        return np.asarray((weights @ self.gram.reshape(len(self.gram), -1)).reshape(self.gram.shape[1:]))

    def residual(self, parameters: Array) -> Array:
        """Sums each joint's squared residuals (n,)."""
        quadratic = (self.gram @ parameters) @ parameters
        return np.maximum(self.square - 2 * self.cross @ parameters + quadratic, 0.0)

    def level(self, parameters: Array) -> Array:
        """Gives each joint's residual RMS (n,) [N m or N], floored where a fit is exact or a joint has no torque."""
        rows = np.maximum(self.count, 1)
        torque = self.square / rows
        floor = np.maximum(1e-6 * torque, 1e-12 * float(torque.max()) + np.finfo(float).tiny)
        return np.sqrt(np.maximum(self.residual(parameters) / rows, floor))


def solve_all(gram: Array, cross: Array, square: Array, ridge: float, pull: GaussianPrior | None) -> Array:
    """Solves several weighted normal equations with one ridge, see `Moments.solve`.

    Args:
        gram: (B, p, p), weighted and summed over the joints.
        cross: (B, p).
        square: (B,), of the torques.
        ridge: how much the pull counts.
        pull: what it pulls to; None for zero.

    Returns:
        Parameters (B, p).
    """
    diagonal = np.arange(gram.shape[1])
    scale = lengths(gram)
    factor = 1.0 / scale
    right = cross * factor
    matrix = gram * factor[:, :, None]
    if pull is None:
        matrix *= factor[:, None, :]
        matrix[:, diagonal, diagonal] += ridge
    else:
        strength = ridge * square[:, None]
        matrix += strength[:, :, None] * (factor[:, :, None] * pull.precision)
        matrix *= factor[:, None, :]
        matrix[:, diagonal, diagonal] += LEAST_RIDGE
        right += strength * (pull.precision @ pull.target) * factor + LEAST_RIDGE * scale * pull.target
    return np.array([solve_nearly_positive(*system) for system in zip(matrix, right, strict=True)]) * factor
