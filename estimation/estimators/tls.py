"""Total least squares: noise in the motion spoils the regressor too, and biases all that take it for exact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import cho_factor, cho_solve, solve_triangular

from estimation.estimators.base import Array, Solution
from estimation.estimators.wls import WeightedLeastSquares
from estimation.linear_algebra.scaled import lengths, square_root
from estimation.regressions.moments import Moments
from estimation.regressions.position_noise import smoothed_noise
from estimation.regressions.regression_data import RegressionData
from estimation.regressions.regularisation import regularisation
from robots.common.errors import InputError, SolverError
from robots.common.stretches import chunks


class TotalLeastSquares(WeightedLeastSquares):
    """(G - mu C) pi = c: least squares less what noise in q, dq, ddq adds to the regressor's Gram matrix G.

    C = E[dY' W dY] follows from the noise of the smoothed motion through the regressor's derivatives, row by row;
    columns that the noise does not reach, such as torque offsets, are exact (mixed total least squares, Golub and Van
    Loan 1980; Van Huffel and Vandewalle 1991). mu is the smallest generalised eigenvalue of [Y tau]'W[Y tau] against
    the noise's covariance, which is total least squares, and at most 1: then C is all that is known.

    The solution's extras: ``noise_share`` (b,), the share of each column's mean square that is noise, and ``mu``.

    Args:
        noise: covariance (n, 3, 3) of the noise in each joint's smoothed q, dq, ddq; None works it out from the
            recorded positions, taking their noise for white.
        temper: see `WeightedLeastSquares`.

    Raises:
        InputError: no covariances.
    """

    name = "tls"

    def __init__(self, noise: ArrayLike | None = None, temper: float = 1.0) -> None:
        super().__init__(temper)
        self.noise = None if noise is None else np.asarray(noise, dtype=float)
        if self.noise is not None:
            shaped = self.noise.ndim == 3 and self.noise.shape[1:] == (3, 3) and bool(np.isfinite(self.noise).all())
            if not shaped or np.linalg.eigvalsh(self.noise).min() < -1e-9 * np.abs(self.noise).max():
                raise InputError(f"noise of shape {self.noise.shape}", allowed="covariances (n, 3, 3)")

    def refine(self, data: RegressionData, values: Array, weights: Array) -> Solution:
        """Corrects least squares for the noise of its regressor.

        Raises:
            InputError: noise of another number of joints.
            SolverError: more noise than there is signal.
        """
        noise = smoothed_noise(data) if self.noise is None else self.noise
        if len(noise) != data.robot.n:
            raise InputError(f"noise of {len(noise)} joints", allowed=f"{data.robot.n}")
        errors = _regressor_noise(data, noise)  # (n, b, b), summed over rows as the Gram matrices are
        share = np.divide(
            weights @ np.einsum("jbb->jb", errors),
            weights @ np.einsum("jbb->jb", data.moments.gram),
            out=np.zeros(data.base.size),
            where=np.einsum("jbb->b", data.moments.gram) > 0,
        )
        mu = 0.0
        if errors.any():
            problem = _Problem(data.moments, weights, errors, data.ridge)
            for _ in range(5):
                values, mu = problem.solve(values)
        return Solution(values=values, weights=weights, extras={"noise_share": share, "mu": mu})


@dataclass(frozen=True)
class _Problem:
    moments: Moments
    weights: Array
    errors: Array
    ridge: float

    def solve(self, values: Array) -> tuple[Array, float]:
        """One round: torque noise from the last values, then mu and new values."""
        moments, weights = self.moments, self.weights
        misfit = np.maximum(moments.count, 1) * moments.level(values) ** 2
        by_motion = np.einsum("p,jpq,q->j", values, self.errors, values, optimize=True)
        # Share of a joint's misfit that is left to the torque's own noise at least.
        torque = weights @ np.maximum(misfit - by_motion, 0.05 * misfit)
        gram = np.tensordot(weights, moments.gram, axes=1)
        errors = np.tensordot(weights, self.errors, axes=1)
        cross, square = weights @ moments.cross, weights @ moments.square
        extra, right = regularisation(moments, weights, gram, self.ridge)
        scale = lengths(gram)
        errors, cross, right = errors / scale[:, None] / scale, cross / scale, right / scale
        matrix = (gram + extra) / scale[:, None] / scale
        matrix[np.diag_indices_from(matrix)] += 1e-13
        # Exact columns make the noise's covariance singular: its root keeps the eigenvalue finite.
        augmented = np.block([[matrix, cross[:, None]], [cross[None], np.array([[square]])]])
        augmented[-1, -1] += 1e-12 * square  # an exact fit leaves nothing to divide by
        noise = np.zeros((len(cross) + 1, len(cross) + 1))
        noise[:-1, :-1], noise[-1, -1] = square_root(errors), np.sqrt(torque)
        try:
            inner = noise.T @ cho_solve(cho_factor(augmented), noise)
            mu = min(1.0, 1 / float(np.linalg.eigvalsh(inner)[-1]))
            lower = np.linalg.cholesky(matrix)
            share, directions = np.linalg.eigh(
                solve_triangular(lower, solve_triangular(lower, errors, lower=True).T, lower=True)
            )
            # A direction of the parameters of which more than this share is noise is corrected as if it were this
            # share: what is left of its signal is too little to divide by.
            gain = 1 / (1 - np.minimum(mu * share, 0.8))
            inner = directions @ (gain * (directions.T @ solve_triangular(lower, cross + right, lower=True)))
            return solve_triangular(lower.T, inner) / scale, mu
        except np.linalg.LinAlgError as error:
            raise SolverError(
                "total least squares: the noise of the motion is larger than the motion",
                remedy="smooth more, or state smaller noise",
            ) from error


def _regressor_noise(data: RegressionData, noise: Array) -> Array:
    """E[dY_j' dY_j] (n, b, b), summed over the rows that count.

    Each joint's noise is taken along the three axes of its own covariance, one standard deviation to either side, so
    that a sign's jump counts as the noise really sees it.
    """
    n, size = data.robot.n, data.base.size
    total = np.zeros((n, size, size))
    roots = [square_root(covariance) for covariance in noise]
    if not np.any(roots):
        return total
    rows = sum(len(part.motion) for part in data.parts)
    # Rows on which the regressor's noise is worked out: more don't know its mean square better.
    stride = max(1, rows // 6000)
    for part in data.parts:
        chosen = np.arange(stride // 2, len(part.motion), stride)
        for piece in chunks(len(chosen)):
            at = chosen[piece]
            state = np.stack([part.motion.q[at], part.motion.dq[at], part.motion.ddq[at]])
            for joint, root in enumerate(roots):
                for direction in root.T:
                    step = np.zeros((3, 1, n))
                    step[:, 0, joint] = direction
                    up, down = (data.base.regressor(*at, gravity=part.gravity) for at in (state + step, state - step))
                    change = (up - down) / 2
                    total += Moments.of(change, np.zeros_like(part.tau[at]), part.mask[at]).gram
    return total * (rows / max(sum(len(range(stride // 2, len(p.motion), stride)) for p in data.parts), 1))
