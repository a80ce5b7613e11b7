"""Drive gains, the torque per ampere of each joint, from runs with and without a payload that is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from estimation.estimators.base import Array
from estimation.linear_algebra.scaled import lengths
from robots.base_parameters import BaseParameters
from robots.common.errors import InputError, NotIdentifiableError
from robots.common.stretches import chunks
from robots.geometry.inertia import BODY_PARAMETERS
from robots.signals import Motion


@dataclass(frozen=True, kw_only=True)
class CurrentRun:
    """A run with known payload.

    Attributes:
        motion: smoothed.
        current: motor currents (N, n) [A].
        mask: zero where a row of a joint does not count (N, n).
        payload: its ten parameters about the last link's frame (10,); None for a run without.
    """

    motion: Motion
    current: Array
    mask: Array
    payload: ArrayLike | None = None


@dataclass(frozen=True, kw_only=True)
class DriveGains:
    """Joint torque per motor current.

    Attributes:
        gains: (n,) [N m/A or N/A].
        standard_errors: (n,), by white noise.
        values: base parameters (b,) of the robot without payload.
        residual_rms: of the current (n,) [A].
    """

    gains: Array
    standard_errors: Array
    values: Array
    residual_rms: Array


def fit_drive_gains(base: BaseParameters, runs: Sequence[CurrentRun]) -> DriveGains:
    """Fits gains and base parameters together, on the scale that a known payload sets (Gautier and Briot 2014).

    For all runs ``g_j i_j = Y_j pi + Y_last,j pi_L`` with pi_L known where there is a payload: linear in gains g and
    parameters pi. Currents carry the noise, so each joint's rows count by the inverse of its torque noise, and what the
    noise adds to the currents' own mean square is taken off (total least squares), iterated.

    Source: M. Gautier, S. Briot, "Global identification of joint drive gains and dynamic parameters of robots", Journal
    of Dynamic Systems, Measurement, and Control 136, 2014, 10.1115/1.4027506.

    Args:
        base: base parameters of the model (b), with a rigid body.
        runs: at least one with a payload; a run without makes the fit better, and friction known.

    Raises:
        InputError: no payload at all, or currents of another shape.
        NotIdentifiableError: runs that leave a gain open, such as a joint that feels nothing of the payload.
    """
    bodies = [k for k, column in enumerate(base.model.columns) if column.term == "rigid_body"]
    if not any(run.payload is not None for run in runs):
        raise InputError(
            "no run with a known payload", remedy="drive gains need a known torque: give a run with a known payload"
        )
    n, size = base.model.robot.n, base.size
    total = np.zeros((n, size + n + 1, size + n + 1))
    count = np.zeros(n)
    for run in runs:
        load = None if run.payload is None else np.asarray(run.payload, dtype=float)
        if load is not None and load.shape != (BODY_PARAMETERS,):
            raise InputError(f"a payload of {load.shape} parameters", allowed=f"({BODY_PARAMETERS},)")
        if np.shape(run.current) != run.motion.q.shape:
            raise InputError(f"currents of shape {np.shape(run.current)}", allowed=f"{run.motion.q.shape}")
        count = count + run.mask.sum(axis=0)
        for rows in chunks(len(run.motion)):
            total += _sums(base, run, load, bodies[-BODY_PARAMETERS:], rows)
    return _fit(total, count, size, n)


def _sums(base: BaseParameters, run: CurrentRun, load: Array | None, last: Sequence[int], rows: slice) -> Array:
    """Per joint (n, b + n + 1, b + n + 1) the Gram matrix of [-Y, i, known torque]."""
    motion = run.motion
    state = motion.q[rows], motion.dq[rows], motion.ddq[rows]
    Y = base.regressor(*state)
    samples, n, size = Y.shape
    wide = np.zeros((samples, n, size + n + 1))
    wide[:, :, :size] = -Y
    wide[:, range(n), size + np.arange(n)] = run.current[rows]
    if load is not None:
        wide[:, :, -1] = base.model.torque(*state, load, columns=last)
    wide *= run.mask[rows, :, None] > 0
    return np.stack([wide[:, j].T @ wide[:, j] for j in range(n)])


def _fit(total: Array, count: Array, size: int, n: int) -> DriveGains:
    gains_at = size + np.arange(n)
    weights, noise = np.ones(n), np.zeros(n)
    gains = np.zeros(n)
    for _ in range(8):
        matrix = np.tensordot(weights, total, axes=1)
        gram, right = matrix[:-1, :-1].copy(), matrix[:-1, -1]
        # The currents' own noise, in their mean square: least squares would shrink the gains by it.
        gram[gains_at, gains_at] -= weights * np.maximum(count, 1) * noise
        scale = lengths(gram)
        scaled = gram / scale[:, None] / scale
        eigenvalues = np.linalg.eigvalsh(scaled)
        # Ratio of smallest to largest eigenvalue of the scaled normal equations, below which a gain is undetermined.
        if eigenvalues[0] < 1e-13 * eigenvalues[-1]:
            raise NotIdentifiableError(
                "the runs do not determine all drive gains",
                remedy="move every joint, with a payload that loads each of them",
            )
        solution = np.linalg.solve(scaled, right / scale) / scale
        before, gains = gains, solution[size:]
        joint = np.concatenate([solution, [-1.0]])
        misfit = np.maximum(np.einsum("p,jpq,q->j", joint, total, joint, optimize=True), 0.0)
        torque_noise = misfit / np.maximum(count - (size + n) / n, 1)
        floor = 1e-12 * total[:, -1, -1].max() / max(count.max(), 1)
        weights = 1 / np.maximum(torque_noise, max(floor, np.finfo(float).tiny))
        noise = torque_noise / np.where(gains != 0, gains, np.inf) ** 2
        # Gains have settled when none moves by more than this share.
        if (np.abs(gains - before) <= 1e-6 * np.abs(gains)).all():
            break
    inverse = np.linalg.inv(scaled) / scale[:, None] / scale
    return DriveGains(
        gains=gains,
        standard_errors=np.sqrt(np.diag(inverse)[size:]),
        values=solution[:size],
        residual_rms=np.sqrt(noise),
    )
