"""Up to which frequency positions are motion: their acceleration must help to explain the torque, not spoil it."""

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
# Of the caps those that tell whether there is anything to choose.
TELLING = (10.0, 4.0)
# Positions are spoilt where low-passed ones leave less than this share of the residual: what an elastic gear or a late
# torque make of the base model is far less.
SPOILT = 0.7
# A cap is as good as the best where the residual is within this factor.
NEAR = 1.1
ROWS = 1000
WIDTH = 0.02  # [rad/s or m/s] of the sign
SLOW = 0.05  # of a joint's RMS speed, below which its friction's sign is not known
FAINT = 1e-6


def select_position_cutoff(robot: Robot, logs: Sequence[Prepared], cutoffs: Array) -> float:
    """Finds the frequency [Hz] above which positions are noise by what their acceleration does to the torque's fit.

    An encoder's noise is white where its steps are crossed quickly. Where a joint is slow, or samples repeat, it has
    more power at low frequencies, as motion has, and no floor in the spectrum tells the two apart. In the acceleration
    it then drowns the motion, and with it all columns that share a parameter with it, gravity's first of all. The base
    model tells: fitted with the positions low-passed lower and lower, it fits better as long as noise is taken away.

    Args:
        robot: the robot.
        logs: with torque, and positions on a grid.
        cutoffs: at which the joints would be low-passed otherwise (n,) [Hz].

    Returns:
        The highest of `CAPS` with which the fit is about as good as can be; infinity where the positions spoil nothing.
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
    """Mean over the joints of the logarithm of the base model's residual."""
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
        # Each log as it was recorded: a payload or another gravity that is known must not pass for noise.
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
