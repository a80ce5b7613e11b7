"""How much the measurements say of each number: Gauss-Newton information, for coloured noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.thermal.runs.measurements import Row
from estimation.thermal.transcriptions.noise import split
from estimation.thermal.transcriptions.transcription import Solution, Transcription
from estimation.uncertainty import Part, covariance, white_noise_covariance
from robots.common.arrays import Array


@dataclass(frozen=True, kw_only=True, eq=False)
class Information:
    """Information of the measurements.

    Attributes:
        covariance: of all coordinates (P, P), zero where one is not free.
        colour: median ratio of the standard errors to those of white noise.
        sensitivities: of the predicted measurements by the coordinates (M, P).
    """

    covariance: Array
    colour: float
    sensitivities: Array


def gather(
    problem: Transcription, solution: Solution, free: NDArray[np.bool_], weights: Array, prior: Array
) -> Information:
    """Collects the information at a solution.

    The covariance is that of weighted least squares under an autoregressive noise fitted to the residual of each
    channel; rows of one run are taken for neighbours in time.
    """
    J = problem.sensitivities(solution.coordinates, solution.states)
    for r, run in enumerate(problem.runs):
        # A run that starts at surroundings which are themselves estimated moves with them.
        slots = problem.layout.start_slots(r)
        if run.ambient is None and not free[slots].any():
            J[:, problem.layout.ambient_slot(r)] += J[:, slots].sum(axis=1)
    slopes = J * weights[:, None]
    residual = weights * (problem.predict(solution.coordinates, solution.states) - problem.measured)
    inside = slopes[:, free]
    pull = np.diag(_prior_information(problem, prior)[free])
    inverse, lost = _inverse(inside.T @ inside + pull)
    honest, white = inverse @ pull @ inverse, inverse @ pull @ inverse
    for channel in sorted({row.channel for row in problem.rows}):
        parts = _parts(problem.rows, channel, inside, residual)
        weight = np.ones(1)
        honest = honest + covariance(parts, weight, inverse)
        white = white + white_noise_covariance(parts, weight, inverse)
    ratios = np.sqrt(np.maximum(np.diag(honest), 0.0) / np.maximum(np.diag(white), 1e-300))
    which = np.flatnonzero(free)
    full = np.zeros((problem.size, problem.size))
    # Standard error of a coordinate in an undetermined direction: a factor of e^100 of a positive parameter.
    full[np.ix_(which, which)] = honest + 100.0**2 * lost @ lost.T
    return Information(
        covariance=full,
        colour=max(1.0, float(np.median(ratios))) if len(ratios) else 1.0,
        sensitivities=J,
    )


def _prior_information(problem: Transcription, prior: Array) -> Array:
    information = np.zeros(problem.size)
    information[problem.layout.ambient_slots] = prior**2
    return information


def _inverse(matrix: Array) -> tuple[Array, Array]:
    """Inverts the information except for undetermined directions, which are returned as columns."""
    scale = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    values, vectors = np.linalg.eigh(matrix / scale[:, None] / scale)
    # Directions in which the information is weaker by this much are not determined at all.
    known = values > 1e-10 * max(float(values[-1]), 1e-300)
    directions = vectors / scale[:, None]
    lost = directions[:, ~known]
    return (directions[:, known] / values[known]) @ directions[:, known].T, lost / np.abs(lost).max(
        axis=0, initial=1e-300
    )


def _parts(rows: Sequence[Row], channel: str, slopes: Array, residual: Array) -> list[Part]:
    parts = []
    for row, Y, e in zip(rows, split(rows, slopes), split(rows, residual), strict=True):
        if row.channel != channel:
            continue

        def regressor(start: int, stop: int, Y: Array = Y) -> Array:
            return Y[start:stop, None, :]

        parts.append(Part(rows=len(e), regressor=regressor, mask=np.ones((len(e), 1)), residual=e[:, None]))
    return parts
