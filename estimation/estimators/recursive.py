"""Recursive least squares: an estimate and its covariance at any time of a stream."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import cho_factor, cho_solve

from estimation.estimators.base import Array, Solution
from estimation.estimators.wls import WeightedLeastSquares
from estimation.linear_algebra.scaled import lengths
from estimation.regressions.regression_data import RegressionData
from estimation.regressions.regularisation import regularisation
from robots.base_parameters import BaseParameters
from robots.common.errors import InputError, NotIdentifiableError
from robots.signals import Motion


class Stream:
    """Weighted least squares on a stream, in information form: exact after every chunk, whatever its length.

    ``Lambda <- lambda^m Lambda + sum_i lambda^(m - i) Y_i' W Y_i`` and likewise for the right-hand side, lambda the
    forgetting factor per sample (Ljung, System Identification, section 11.2). With lambda = 1 it is the batch estimate.

    Args:
        base: base parameters of the model (b).
        weights: of the joints' rows, their inverse noise variances (n,) [1/(N m)^2 or alike].
        forgetting: factor per sample by which the past counts less, above 0 and up to 1; 1 - 1 / (memory in samples).
        prior: base parameters to start from (b,); zeros by default.
        prior_covariance: of the prior (b, b) or its diagonal (b,); None for no prior.

    Raises:
        InputError: arrays of other sizes, weights that are not positive, a forgetting out of range.
    """

    def __init__(
        self,
        base: BaseParameters,
        weights: ArrayLike,
        *,
        forgetting: float = 1.0,
        prior: ArrayLike | None = None,
        prior_covariance: ArrayLike | None = None,
    ) -> None:
        self.base = base
        self.weights = np.asarray(weights, dtype=float)
        n, size = base.model.robot.n, base.size
        if self.weights.shape != (n,) or not (np.isfinite(self.weights) & (self.weights > 0)).all():
            raise InputError(f"weights {self.weights}", allowed=f"{n} positive numbers")
        if not 0 < forgetting <= 1:
            raise InputError(f"a forgetting of {forgetting}", allowed="above 0, up to 1")
        self.forgetting = forgetting
        self.information = np.zeros((size, size))
        self.right = np.zeros(size)
        self._rows = 0.0
        self._misfit = 0.0
        if prior_covariance is not None:
            covariance = np.asarray(prior_covariance, dtype=float)
            covariance = np.diag(covariance) if covariance.ndim == 1 else covariance
            start = np.zeros(size) if prior is None else np.asarray(prior, dtype=float)
            if covariance.shape != (size, size) or start.shape != (size,):
                raise InputError(f"a prior of shapes {start.shape}, {covariance.shape}", allowed=f"{size} parameters")
            self.information = np.linalg.inv(covariance)
            self.right = self.information @ start
            self._misfit = float(start @ self.right)

    def update(self, motion: Motion, tau: ArrayLike, mask: ArrayLike | None = None) -> Stream:
        """Takes a chunk of m samples in.

        Args:
            motion: smoothed motion of the chunk.
            tau: measured torque (m, n) [N m or N].
            mask: zero where a row does not count (m, n); all count by default.

        Returns:
            Itself.

        Raises:
            InputError: a torque or mask of another shape, or not finite.
        """
        torque = np.asarray(tau, dtype=float)
        if torque.shape != motion.q.shape or not np.isfinite(torque).all():
            raise InputError(f"torque of shape {torque.shape}", allowed=f"{motion.q.shape}, finite", column="tau")
        counts = np.ones_like(torque) if mask is None else np.asarray(mask, dtype=float)
        if counts.shape != torque.shape:
            raise InputError(f"a mask of shape {counts.shape}", allowed=f"{torque.shape}")
        return self.update_rows(self.base.regressor(motion.q, motion.dq, motion.ddq), torque, counts)

    def update_rows(self, Y: Array, tau: Array, mask: Array) -> Stream:
        """Takes in m samples whose regressor (m, n, b) is at hand; see `update`."""
        age = self.forgetting ** np.arange(len(tau) - 1, -1, -1)
        root = np.sqrt(self.weights * age[:, None]) * (mask > 0)
        rows = (Y * root[:, :, None]).reshape(-1, Y.shape[2])
        measured = (tau * root).reshape(-1)
        fade = self.forgetting ** len(tau)
        self.information = fade * self.information + rows.T @ rows
        self.right = fade * self.right + rows.T @ measured
        self._misfit = fade * self._misfit + float(measured @ measured)
        self._rows = fade * self._rows + float((age[:, None] * (mask > 0)).sum())
        return self

    @property
    def values(self) -> Array:
        """The estimate now (b,).

        Raises:
            NotIdentifiableError: the data do not yet determine all parameters.
        """
        return self.solution()[0]

    @property
    def covariance(self) -> Array:
        """Covariance of the estimate now (b, b), the weights being inverse noise variances up to one common factor.

        White noise is assumed: if the residual is correlated in time, it is too small.
        """
        values, inverse = self.solution()
        misfit = max(self._misfit - float(values @ self.right), 0.0)
        return np.asarray(inverse * misfit / max(self._rows - len(values), 1.0))

    def solution(self, extra: tuple[Array, Array] | None = None) -> tuple[Array, Array]:
        """Solves for the estimate (b,) and the inverse information (b, b).

        Args:
            extra: information (b, b) and right-hand side (b,) of a regularisation, which the stream does not keep.

        Raises:
            NotIdentifiableError: the data do not yet determine all parameters.
        """
        information, right = self.information, self.right
        if extra is not None:
            information, right = information + extra[0], right + extra[1]
        scale = lengths(information)
        matrix = information / scale[:, None] / scale
        try:
            factor = cho_factor(matrix)
        except np.linalg.LinAlgError as error:
            raise NotIdentifiableError(
                "the data do not yet determine all parameters", remedy="give a prior covariance, or more data"
            ) from error
        inverse = cho_solve(factor, np.eye(len(scale))) / scale[:, None] / scale
        return cho_solve(factor, right / scale) / scale, inverse


class RecursiveLeastSquares(WeightedLeastSquares):
    """`Stream` over the logs, chunk by chunk: what a monitor sees at the end of them.

    Args:
        forgetting: see `Stream`.
        temper: see `WeightedLeastSquares`.

    Raises:
        InputError: a forgetting out of range.
    """

    name = "recursive"

    def __init__(self, forgetting: float = 1.0, temper: float = 1.0) -> None:
        super().__init__(temper)
        if not 0 < forgetting <= 1:
            raise InputError(f"a forgetting of {forgetting}", allowed="above 0, up to 1")
        self.forgetting = forgetting

    def refine(self, data: RegressionData, values: Array, weights: Array) -> Solution:
        """Streams the rows; the extras hold the ``stream``, ready for more."""
        stream = Stream(data.base, weights, forgetting=self.forgetting)
        for Y, tau, mask in data.chunks():
            stream.update_rows(Y, tau, mask)
        extra = regularisation(data.moments, weights, stream.information, data.ridge)
        return Solution(values=stream.solution(extra)[0], weights=weights, extras={"stream": stream})
