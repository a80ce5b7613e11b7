"""Cut-off of the positions, chosen by how well the base model then explains the torque."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimation.diagnosis.recordings.smoothed_motion import smooth_motion
from estimation.regressions.preparation import Prepared
from robots.regressor import default_model
from robots.robot import Robot
from robots.terms.situations.flange_body import with_body

Array = NDArray[np.float64]

CAPS = (40.0, 25.0, 16.0, 10.0, 6.5, 4.0)  # [Hz]
# Cut-offs [Hz] that are tried first, to see whether a lower one helps at all.
TELLING = (10.0, 4.0)
# A lower cut-off is needed if it reduces the residual below this share. An elastic gear or a delayed torque changes the
# base model's residual far less.
SPOILT = 0.7
# Residuals within this factor of the best are equivalent.
NEAR = 1.1
ROWS = 1000
WIDTH = 0.02  # [rad/s or m/s] width of the friction sign
SLOW = 0.05  # share of a joint's RMS speed below which the sign of its friction is unknown
FAINT = 1e-6


def select_position_cutoff(robot: Robot, logs: Sequence[Prepared], cutoffs: Array) -> float:
    """Selects the highest frequency [Hz] at which positions are motion, by the residual of the base model.

    Encoder noise is white while the joint crosses encoder steps quickly. If a joint is slow, or samples repeat, the
    noise has more power at low frequencies, as motion has. A spectrum then shows no noise floor. Such noise dominates
    the acceleration and distorts all columns that share parameters with it, gravity first. As long as a lower cut-off
    removes noise, the base model fits better.

    Args:
        robot: the robot.
        logs: logs with torque, and positions on a grid.
        cutoffs: cut-offs of the joints by their spectra (n,) [Hz].

    Returns:
        The highest of `CAPS` [Hz] with a residual near the smallest; infinity if no lower cut-off is needed.
    """
    known = {np.inf: _residual(robot, logs, cutoffs)}

    def best(caps: Sequence[float]) -> float:
        for cap in caps:
            if cap < float(np.max(cutoffs)) and cap not in known:
                known[cap] = _residual(robot, logs, np.minimum(cutoffs, cap))
        return min(known.values())

    if best(TELLING) >= known[np.inf] + np.log(SPOILT):
        return np.inf
    least = best(CAPS)
    return max(cap for cap, error in known.items() if error <= least + np.log(NEAR))


def _residual(robot: Robot, logs: Sequence[Prepared], cutoffs: Array) -> float:
    """Computes the mean over the joints of the logarithm of the base model's residual."""
    model = default_model(robot, velocity_scale=WIDTH)
    blocks, targets = [], []
    total = sum(len(log.positions.t) for log in logs)
    for log in logs:
        t, period = log.positions.t, log.positions.period
        q, dq, ddq = smooth_motion(log.positions.q, period, cutoffs)
        edge = min(round(1 / (float(cutoffs.min()) * period)), len(t) // 4)
        rows = np.arange(edge, len(t) - edge, max(1, total // ROWS))
        speed = np.sqrt(np.mean(dq**2, axis=0))
        known = (np.abs(dq[rows]) > SLOW * speed) | (speed < 1e-9)
        tau = np.column_stack([np.interp(t[rows], log.log.t, column) for column in log.tau.T])
        # Each log under its own conditions: a known payload or another gravity is not noise.
        motion = (q[rows], dq[rows], ddq[rows])
        own = model.under(log.log.gravity)
        if log.log.payload is not None:
            tau -= own.torque(*motion, with_body(model, np.zeros(model.size), log.log.payload))
        blocks.append(own.regressor(*motion) * known[:, :, None])
        targets.append(tau * known)
    Y, tau = np.concatenate(blocks), np.concatenate(targets)
    scale = np.maximum(tau.std(axis=0), 1e-9 * max(float(np.abs(tau).max()), 1e-12))
    flat = (Y / scale[:, None]).reshape(-1, Y.shape[2])
    flat = flat / np.maximum(np.linalg.norm(flat, axis=0), 1e-300)
    target = (tau / scale).reshape(-1)
    values, vectors = np.linalg.eigh(flat.T @ flat)
    kept = values > FAINT * values[-1]
    basis = flat @ (vectors[:, kept] / np.sqrt(values[kept]))
    left = (target - basis @ (basis.T @ target)).reshape(tau.shape)
    return float(np.mean(np.log(np.maximum(np.sqrt(np.mean(left**2, axis=0)), 1e-9))))
