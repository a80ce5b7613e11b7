"""Nuisance functions of each joint's own state, projected out before noise is estimated."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.fft import rfft

from estimation.diagnosis.base_models.baseline import Baseline
from estimation.diagnosis.noise_models.frequency_bands import Band
from estimation.diagnosis.recordings.recording import Recording
from estimation.linear_algebra.orthonormal import orthonormal
from estimation.linear_algebra.scaled import inverse_root
from robots.common.arrays import Array

# Numbers of knots: over the range of position, and over time for friction. Knots of speed, as shares of the largest.
POSITIONS, TIMES = 8, 5
SPEEDS = (0.0, 0.03, 0.1, 0.3, 0.6, 1.0)
# Duration [s] of the logs below which the functions would absorb most of the noise at the frequencies of the motion.
SHORTEST = 20.0
RANGE = 1e-3  # [rad or m] range of a joint's position below which it has no functions
# Directions of columns below this share of the largest are dropped.
FAINT = 1e-6
# Least share of the noise power that counts as left at a frequency; a smaller one is no measure of the noise.
LEAST_KEPT = 0.2


class NuisanceProjection:
    """Projection of nuisance columns out of white rows, joint by joint, and the share of noise that remains.

    Args:
        columns: nuisance columns of each joint (N, k); an empty sequence for none.
        bands: bands of the joints.
        runs: rows of each log.
        measured: white rows of all logs that count (M, n).
    """

    def __init__(
        self, columns: Sequence[Array], bands: Sequence[Band], runs: Sequence[slice], measured: NDArray[np.bool_]
    ) -> None:
        self.pieces = []  # per joint and log
        lengths = [-(-(run.stop - run.start) // bands[0].stride) for run in runs]
        self.measured = np.split(measured, np.cumsum(lengths)[:-1])
        starts = tuple(run.start for run in runs)
        for j, (X, band) in enumerate(zip(columns, bands, strict=False)):
            whole = band.passed(np.asfortranarray(X), starts=starts) * measured[:, [j]]
            self.pieces.append(np.split(orthonormal(whole, FAINT), np.cumsum(lengths)[:-1]))

    def left(self, pieces: list[Array]) -> list[Array]:
        """Projects the nuisance columns out of the residuals (M, n) of each log; rows that do not count become zero."""
        result = [piece * rows for piece, rows in zip(pieces, self.measured, strict=True)]
        pieces = [piece.copy() for piece in result]
        for j, own in enumerate(self.pieces):
            fitted = sum(X.T @ piece[:, j] for X, piece in zip(own, pieces, strict=True))
            for X, piece in zip(own, result, strict=True):
                piece[:, j] -= X @ fitted
        return result

    def kept(self, size: int, counts: Array) -> Array:
        """Computes the share of white noise power that remains at each frequency.

        Args:
            size: length of the Fourier transform.
            counts: rows of each joint that count (n,).

        Returns:
            Shares (size // 2 + 1, n).
        """
        result = np.ones((size // 2 + 1, len(counts)))
        for j, own in enumerate(self.pieces):
            taken = sum((np.abs(rfft(np.ascontiguousarray(X.T), size)) ** 2).sum(axis=0) for X in own)
            result[:, j] = np.maximum(1.0 - taken / counts[j], LEAST_KEPT)
        return result


def is_short(recording: Recording) -> bool:
    """Returns whether the logs are so short that nuisance functions would absorb most of the noise."""
    return recording.duration < SHORTEST


def build_nuisance_projection(recording: Recording, baseline: Baseline, residual: Array) -> tuple[Array, ...]:
    """Evaluates nuisance functions of position, speed, load, and time, with the base model projected out.

    Most effects of the catalogue resemble such a function. What they leave in the residual is as fast as the motion. It
    would pass for coloured noise and hide the effects.

    Args:
        recording: the data.
        baseline: the base model's columns.
        residual: torque minus model (N, n) [N m or N].

    Returns:
        Columns (N, k) for each joint; nothing if the logs are too short.
    """
    if is_short(recording):
        return ()
    known = ~recording.sign_unknown
    weights = known / np.maximum(recording.tau.std(axis=0), 1e-12)
    sign = baseline.situation(recording, np.zeros(baseline.base.size)).sign
    root = inverse_root(baseline.moments(weights, recording.tau).joined().gram[0], FAINT**2)
    result = []
    for j in range(recording.n):
        columns = _functions(recording, sign, recording.tau - residual, j)
        cross = baseline.columns[:, j].T @ (columns * weights[:, j, None] ** 2)
        result.append(columns - baseline.columns[:, j] @ (root @ (root.T @ cross)))
    return tuple(result)


def _functions(recording: Recording, sign: Array, torque: Array, joint: int) -> Array:
    q, speed = recording.q[:, joint], np.abs(recording.dq[:, joint])
    if np.ptp(q) < RANGE:
        return np.zeros((len(q), 0))
    load = torque[:, joint] / max(float(np.abs(torque[:, joint]).max()), 1e-12)
    blocks = [
        _hats(q, np.linspace(q.min(), q.max(), POSITIONS)),
        sign[:, joint, None] * _hats(speed, np.array(SPEEDS) * speed.max()),
        np.column_stack([np.abs(load) * sign[:, joint], np.abs(load) * load, load**3]),
        sign[:, joint, None] * _hats(recording.t, np.linspace(recording.t[0], recording.t[-1], TIMES)),
    ]
    return np.hstack(blocks)


def _hats(x: Array, knots: Array) -> Array:
    return np.column_stack([np.interp(x, knots, unit) for unit in np.eye(len(knots))])
