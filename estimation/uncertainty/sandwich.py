"""Covariance of least squares under noise that is correlated in time and across joints."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from estimation.linear_algebra.scaled import lengths
from estimation.uncertainty.autoregressive import HIGHEST_NOISE_ORDER, Noise, autocovariance, fit_noise, taps
from estimation.uncertainty.averages import Averages
from robots.common.arrays import Array
from robots.common.stretches import chunks

# Above so many rows the fit absorbs too little of the noise to matter.
MOST_CORRECTED = 30_000
# So many times Akaike's order: standard errors hang on the noise's density at rest, where that order stops short.
NOISE_ORDER_FACTOR = 2


@dataclass(frozen=True)
class Part:
    """One log of a fit.

    Attributes:
        rows: number of samples N.
        regressor: (start, stop) -> Y (stop - start, n, p).
        mask: (N, n).
        residual: (N, n), as the fit left it.
        used: per joint the indices of the columns that act on it; None for all.
        split: (start, stop) -> each joint's own columns, n arrays (stop - start, p_j); None to take them out of Y.
        sums: (start, stop, size) -> the same summed over groups of `size` rows as they count; None to sum them.
        repeats: how often the rows count.
    """

    rows: int
    regressor: Callable[[int, int], Array]
    mask: Array
    residual: Array
    used: Sequence[NDArray[np.intp]] | None = None
    split: Callable[[int, int], Sequence[Array]] | None = None
    sums: Callable[[int, int, int], Sequence[Array]] | None = None
    repeats: int = 1

    def columns(self, start: int, stop: int) -> list[tuple[Array, NDArray[np.intp]]]:
        """Evaluates each joint's columns (stop - start, p_j), with their indices."""
        if self.split is not None and self.used is not None:
            return list(zip(self.split(start, stop), self.used, strict=True))
        Y = self.regressor(start, stop)
        used = self.used or [np.arange(Y.shape[2])] * Y.shape[1]
        return [(Y[:, joint, columns], columns) for joint, columns in enumerate(used)]

    def chunks(self) -> Iterator[slice]:
        """Cuts the rows into pieces."""
        return chunks(self.rows)


def covariance(
    parts: Sequence[Part], weights: Array, inverse: Array, seed: int = 0, share: float = 1.0, averaged: int = 1
) -> Array:
    """Estimates the covariance of weighted least squares.

    The inner matrix of the sandwich is Y'W Gamma W Y. Gamma is the autocovariance of an autoregressive model of the
    residual, with innovations correlated across joints. The fit removes noise from the residual, mostly at low
    frequency. This is corrected: noise drawn from the model goes through the same fit, and the model is scaled by its
    loss. A second estimate from the products of innovations guards against noise that is stronger where the arm moves
    faster; each parameter's larger standard error counts.

    Args:
        parts: the logs.
        weights: of the joints' rows (n,).
        inverse: of the weighted Gram matrix (p, p).
        seed: of the drawn noise.
        share: of the fitted rows that the parts hold, where they stand for a longer log.
        averaged: of more than `MOST_CORRECTED` rows so many are averaged at a time, see `Averages`.

    Returns:
        The covariance (p, p).
    """
    # In a long log, the fit removes too little of the noise to matter.
    long = sum(part.rows for part in parts) > MOST_CORRECTED
    seen: Sequence[Part | Averages] = parts
    lost = np.zeros_like(inverse)
    if long and averaged > 1:
        whole = [part for part in parts if part.rows >= averaged]
        averages = [Averages.of(part.columns, part.mask, part.residual, averaged, 4096, part.sums) for part in whole]
        lost = sum((part.lost(weights, len(inverse)) for part in averages), start=lost)
        seen = averages
    plain = noise = _noise(seen, np.zeros((len(weights), HIGHEST_NOISE_ORDER + 1)))
    if share == 1 and not long:
        noise = _corrected(parts, weights, inverse, plain, np.random.default_rng(seed))
    model, robust = ((meat + lost) / share for meat in _meats(seen, weights, noise, len(inverse)))
    scale = float(np.mean(np.diag(noise.covariance) / np.diag(plain.covariance)))
    first, second = spread_of(model, inverse), scale * spread_of(robust, inverse)
    return at_least(first, np.diag(second))


def at_least(covariance: Array, variances: Array) -> Array:
    """Raises a covariance (p, p) so that each variance is at least a given one (p,); the correlations stay."""
    own = np.diag(covariance)
    factor = np.sqrt(np.maximum(1.0, np.divide(variances, own, out=np.ones_like(own), where=own > 0)))
    return covariance * factor[:, None] * factor


def spread_of(meat: Array, inverse: Array) -> Array:
    """Multiplies inverse meat inverse (p, p), positive definite whatever rounding leaves of it.

    Along directions that the data hardly determine the inverse is of the order of 1e13, and its products with a meat of
    sixteen digits are rounding of either sign. As R'R, R = root(meat) inverse, they are still a variance; and an
    eigenvalue of the meat is not known below its last digit, so that a direction without data comes out as one of which
    nothing is known, not as one without error.

    Args:
        meat: symmetric, positive semidefinite up to rounding (p, p).
        inverse: symmetric (p, p).
    """
    scale = lengths(meat)
    values, vectors = np.linalg.eigh(meat / scale[:, None] / scale)
    known = max(float(values[-1]), np.finfo(float).tiny) * len(values) * np.finfo(float).eps
    root = (np.sqrt(np.maximum(values, known)) * vectors).T @ (scale[:, None] * inverse)
    return np.asarray(root.T @ root)


def white_noise_covariance(parts: Sequence[Part], weights: Array, inverse: Array) -> Array:
    """Gives the textbook covariance (p, p), right only if the residual were white."""
    count = sum(part.mask.sum(axis=0) for part in parts)
    variance = sum((part.residual**2).sum(axis=0) for part in parts) / np.maximum(count, 1)
    meat = np.zeros_like(inverse)
    for part in parts:
        for rows in part.chunks():
            Y = part.regressor(rows.start, rows.stop) * (weights * np.sqrt(variance) * part.mask[rows])[:, :, None]
            flat = Y.reshape(-1, Y.shape[2])
            meat += flat.T @ flat
    return spread_of(meat, inverse)


def batch_factors(scores: Array, inverse: Array, model: Array) -> Array:
    """How much larger errors are (p,) by the scatter of batches than by a model of the residual's colour.

    Sums of Y'We over stretches much longer than the noise's memory are independent, whatever the colour and however
    it changes with the motion; a residual that drifts over seconds, which no short model sees, shows in them.

    Args:
        scores: Y'We of each batch (B, p).
        inverse: of the weighted Gram matrix (p, p).
        model: the covariance by the model (p, p).

    Returns:
        Factors, 1 where there are too few batches or their scatter is what chance makes of the model's.
    """
    batches = len(scores)
    ones = np.ones(scores.shape[1])
    # Fewer batches than this say too little of a standard error.
    if batches < 100:
        return ones
    by_batches = np.sqrt(np.einsum("pq,qr,pr->p", inverse, scores.T @ scores, inverse, optimize=True))
    by_model = np.sqrt(np.maximum(np.diag(model), np.finfo(float).tiny))
    ratio = by_batches / by_model
    # The standard deviation of B batches is known to 1 / sqrt(2 B).
    return np.where(ratio > 1 + 2 / np.sqrt(2 * batches), ratio, ones)


def _noise(parts: Sequence[Part | Averages], correction: Array) -> Noise:
    counts = sum(part.mask.sum(axis=0) for part in parts)
    residual = np.concatenate([part.residual for part in parts])
    own = np.stack([autocovariance(residual[:, j], counts[j]) for j in range(residual.shape[1])])
    return fit_noise(residual, counts, own + correction, NOISE_ORDER_FACTOR)


def _corrected(parts: Sequence[Part], weights: Array, inverse: Array, noise: Noise, rng: np.random.Generator) -> Noise:
    for _ in range(2):
        noise = _noise(parts, _lost(parts, weights, inverse, noise, rng))
    return noise


def _lost(parts: Sequence[Part], weights: Array, inverse: Array, noise: Noise, rng: np.random.Generator) -> Array:
    """Autocovariance (n, lags + 1) that a fit takes out of noise of this model, by simulation."""
    joints = len(weights)
    counts = sum(part.mask.sum(axis=0) for part in parts)
    draws_per_row = 8
    drawn = [np.stack([noise.simulated(part.rows, rng) for _ in range(draws_per_row)], axis=2) for part in parts]
    cross = np.zeros((len(inverse), draws_per_row))
    for part, draws in zip(parts, drawn, strict=True):
        for rows in part.chunks():
            Y = part.regressor(rows.start, rows.stop)
            weighted = draws[rows] * (part.mask[rows] * weights * part.repeats)[:, :, None]
            cross += Y.reshape(-1, Y.shape[2]).T @ weighted.reshape(-1, draws_per_row)
    fitted = inverse @ cross
    lost = np.zeros((joints, HIGHEST_NOISE_ORDER + 1))
    for part, draws in zip(parts, drawn, strict=True):
        left = np.empty_like(draws)
        for rows in part.chunks():
            Y = part.regressor(rows.start, rows.stop)
            left[rows] = draws[rows] - (Y.reshape(-1, Y.shape[2]) @ fitted).reshape(-1, joints, draws_per_row)
        for j in range(joints):
            mask = part.mask[:, j]
            for k in range(draws_per_row):
                before = autocovariance(draws[:, j, k] * mask, counts[j])
                lost[j] += before - autocovariance(left[:, j, k] * mask, counts[j])
    return lost / draws_per_row


def _meats(parts: Sequence[Part | Averages], weights: Array, noise: Noise, size: int) -> tuple[Array, Array]:
    """The sandwich's meat from the model, and from the products of innovations (p, p)."""
    products = robust = np.zeros((0, 0))
    owner, used = np.zeros(0, dtype=np.intp), np.zeros(0, dtype=np.intp)
    for part in parts:
        innovations = np.ascontiguousarray(noise.whitened(part.residual).T)
        states: list[Array] = []
        # Gamma = A^-1 C A^-T: the transposed inverse filter runs from the last row to the first.
        for rows in reversed(list(part.chunks())):
            found = part.columns(rows.start, rows.stop)
            if not products.size:
                owner = np.repeat(np.arange(len(found)), [len(columns) for _, columns in found])
                used = np.concatenate([columns for _, columns in found])
                products, robust = np.zeros((len(owner), len(owner))), np.zeros((size, size))
            if not states:
                states = [np.zeros((len(k), len(a))) for a, (_, k) in zip(noise.coefficients, found, strict=True)]
            # Columns lie one after the other in memory: filters and sums run along them.
            filtered, scores = np.empty((len(owner), rows.stop - rows.start)), np.zeros((size, rows.stop - rows.start))
            end = 0
            for j, (a, (Y, columns)) in enumerate(zip(noise.coefficients, found, strict=True)):
                backward = (Y.T * (weights[j] * part.repeats * part.mask[rows, j]))[:, ::-1]
                if len(a):
                    backward, states[j] = lfilter([1.0], taps(a), backward, zi=states[j])
                begin, end = end, end + len(columns)
                filtered[begin:end] = backward[:, ::-1]
                scores[columns] += filtered[begin:end] * innovations[j, rows]
            products += filtered @ filtered.T
            robust += scores @ scores.T
    # sum_jk C_jk F_j'F_k, each column put where it belongs.
    gather = np.eye(size)[used]
    return gather.T @ (noise.covariance[np.ix_(owner, owner)] * products) @ gather, robust
