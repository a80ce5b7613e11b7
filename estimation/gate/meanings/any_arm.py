"""How well any arm explains the torques: a fit that knows the kinds of the joints, and nothing else of the robot."""

from __future__ import annotations

import numpy as np

from estimation.gate.quick_fits.fitted import Fitted
from estimation.gate.quick_fits.joint_columns import OWN
from estimation.gate.quick_fits.joint_fit import FOLDS
from estimation.gate.quick_fits.whole_fit import WholeFit
from robots.common.arrays import Array

# Rows of the fit, and weight of each further joint in a product of sines and cosines: with 0.15 to 0.6 the errors on
# measured logs are the same within a tenth.
ROWS, FURTHER = 750, 0.3
# Weight of rotors, friction and offsets over that of the links: they are hardly shrunk.
OWN_WEIGHT = 10.0
# Candidates for the ridge, over the trace of the Gram matrix. Cross-validation chooses, joint by joint.
RIDGES = tuple(10.0 ** np.arange(-6, 1))


def any_arm(fitted: Fitted) -> WholeFit:
    """Gives the held-out error of any arm over the torque's standard deviation, as the fit of the described one does.

    Gravity and inertia of any serial arm are sums of products of 1, sin q_k and cos q_k over the joints k, those of the
    inertia times an acceleration. A kernel ridge regression holds all these products, ``prod_k (1 + c cos(q_k - q_k'))
    (1 + ddq' ddq)``, beside friction, rotor and offset of each joint. Axes, lengths, zeros, signs and order of the
    joints, and the units of the torques, have no effect on its error.

    Args:
        fitted: the log, with the described kinds of joints.
    """
    rows, spread = fitted.rows, fitted.logged_spread
    kept = rows.thinned(max(1, -(-len(rows.q) // ROWS)))
    kept = kept[~rows.rest[kept].all(axis=1)]
    joints = np.flatnonzero(spread > 0)
    tau = np.column_stack([rows.raw(int(joint))[kept] for joint in joints])
    tau = (tau - tau.mean(axis=0)) / spread[joints]
    counted = ~rows.rest[kept][:, joints]
    own = np.hstack([part.Y[kept, -OWN:] for part in rows.joints])
    kernel = _links(rows.q[kept], fitted.robot.chain.kinds, rows.ddq[kept]) + OWN_WEIGHT * own @ own.T
    squares = np.zeros((len(RIDGES), len(joints), FOLDS))
    folds = np.array_split(np.arange(len(kept)), FOLDS)
    for fold, held in enumerate(folds):
        others = np.setdiff1d(np.arange(len(kept)), held)
        values, ways = np.linalg.eigh(kernel[np.ix_(others, others)])
        parts, across = ways.T @ tau[others], kernel[np.ix_(held, others)] @ ways
        size = float(np.mean(values))
        for place, ridge in enumerate(RIDGES):
            found = across @ (parts / (np.maximum(values, 0.0) + ridge * size * len(others))[:, None])
            squares[place, :, fold] = np.sum((tau[held] - found) ** 2 * counted[held], axis=0)
    count = np.array([np.count_nonzero(counted[held], axis=0) for held in folds]).T
    best = np.take_along_axis(squares, squares.sum(axis=2).argmin(axis=0)[None, :, None], axis=0)[0]
    errors, by_fold = np.full(len(spread), np.nan), np.full((len(spread), FOLDS), np.nan)
    errors[joints] = np.sqrt(best.sum(axis=1) / np.maximum(count.sum(axis=1), 1))
    by_fold[joints] = np.where(count > 0, np.sqrt(best / np.maximum(count, 1)), np.nan)
    return WholeFit(errors, by_fold)


def _links(q: Array, kinds: tuple[str, ...], ddq: Array) -> Array:
    """Gives the kernel (M, M) of gravity and inertia of all arms with these kinds of joints."""
    kernel = np.ones((len(q), len(q)))
    for position, kind in zip(q.T, kinds, strict=True):
        if kind == "revolute":
            kernel *= 1.0 + FURTHER * np.cos(position[:, None] - position)
        elif position.std() > 0:
            scaled = (position - position.mean()) / position.std()
            kernel *= 1.0 + FURTHER * np.outer(scaled, scaled)
    scaled = ddq / np.maximum(np.sqrt(np.mean(ddq**2, axis=0)), 1e-12)
    return np.asarray(kernel / np.mean(np.diag(kernel)) * (1.0 + scaled @ scaled.T))
