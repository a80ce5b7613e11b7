"""A campaign's logs condensed to normal equations of short times: all that a fit with heat needs of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.models.model import Model
from estimation.preprocessing import resample, smooth
from estimation.regressions.preparation import SIGN_SPEED_SHARE, torque_of
from estimation.thermal.runs.extraction import SEPARATE_RUN_GAP, bins
from robots.common.arrays import Array
from robots.common.stretches import chunks
from robots.signals import Log


@dataclass(frozen=True, kw_only=True, eq=False)
class JointSums:
    """One joint's sums over the samples of each of B bins.

    Attributes:
        used: which of the model's b parameters act on the joint (k,).
        friction: which of those are its friction's (k,).
        gram: (B, k, k) of the regressor's rows.
        cross: (B, k) with the torque.
        square: (B,) of the torque.
        count: rows in which the joint moves fast enough (B,).
        power: mean of each friction column times the velocity (B, f).
    """

    used: NDArray[np.intp]
    friction: NDArray[np.bool_]
    gram: Array
    cross: Array
    square: Array
    count: Array
    power: Array

    def scaled(self, factor: Array) -> tuple[Array, Array]:
        """Sums Gram matrix (k, k) and cross products (k,) with the friction of each bin times a factor (B,)."""
        rigid, own = ~self.friction, self.friction
        gram = self.gram.sum(axis=0)
        gram[np.ix_(rigid, own)] = np.tensordot(factor, self.gram[:, rigid][:, :, own], axes=1)
        gram[np.ix_(own, rigid)] = gram[np.ix_(rigid, own)].T
        gram[np.ix_(own, own)] = np.tensordot(factor**2, self.gram[:, own][:, :, own], axes=1)
        cross = self.cross.sum(axis=0)
        cross[own] = factor @ self.cross[:, own]
        return gram, cross

    def residual(self, factor: Array, values: Array) -> float:
        """Sums squared torque errors for parameters of the joint (k,)."""
        gram, cross = self.scaled(factor)
        return float(max(self.square.sum() - 2.0 * cross @ values + values @ gram @ values, 0.0))

    def friction_scale(self, values: Array) -> tuple[Array, Array]:
        """Friction of each bin against that of the parameters: cross products and squares (B,)."""
        rigid, own = ~self.friction, self.friction
        f, r = values[own], values[rigid]
        square = np.einsum("i,bij,j->b", f, self.gram[:, own][:, :, own], f, optimize=True)
        coupled = np.einsum("i,bij,j->b", f, self.gram[:, own][:, :, rigid], r, optimize=True)
        return self.cross[:, own] @ f - coupled, np.maximum(square, 0.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class Condensed:
    """A campaign, condensed.

    Attributes:
        logs: in order of time.
        runs: indices of the logs of each run: those that lie close to each other.
        edges: of each log's bins.
        joints: sums of each joint, the bins of all logs one after the other.
    """

    logs: tuple[Log, ...]
    runs: tuple[tuple[int, ...], ...]
    edges: tuple[Array, ...]
    joints: tuple[JointSums, ...]

    @property
    def offsets(self) -> NDArray[np.intp]:
        """Where each log's bins begin, and the end."""
        return np.concatenate([[0], np.cumsum([len(edges) - 1 for edges in self.edges])]).astype(np.intp)


def condense(model: Model, logs: Sequence[Log], width: float) -> Condensed:
    """Sums the regressor of an identified model over bins.

    Args:
        model: for its robot, terms, parameters and smoothing.
        logs: positions and torque.
        width: of the bins [s].
    """
    ordered = tuple(sorted(logs, key=lambda log: float(log.t[0])))
    runs: list[list[int]] = []
    for k, log in enumerate(ordered):
        if runs and log.t[0] - ordered[runs[-1][-1]].t[-1] < SEPARATE_RUN_GAP:
            runs[-1].append(k)
        else:
            runs.append([k])
    parts = [_sums_of(model, log, width) for log in ordered]
    n = model.robot.n
    joints = []
    for j in range(n):
        whole = [np.concatenate([part[1][j][key] for part in parts]) for key in range(5)]
        used = np.flatnonzero(np.einsum("bii->i", whole[0]) > 0.0)
        own = np.array([c.friction and c.joint == j + 1 for c in model.parameters])
        joints.append(
            JointSums(
                used=used,
                friction=own[used],
                gram=whole[0][:, used][:, :, used],
                cross=whole[1][:, used],
                square=whole[2],
                count=whole[3],
                power=whole[4],
            )
        )
    return Condensed(
        logs=ordered,
        runs=tuple(tuple(run) for run in runs),
        edges=tuple(part[0] for part in parts),
        joints=tuple(joints),
    )


def _sums_of(model: Model, log: Log, width: float) -> tuple[Array, list[list[Array]]]:
    motion = smooth(resample(log.t, log.q), model.cutoff)
    tau = torque_of(model.robot, log)
    edges, index = bins(motion.t, width)
    count, size, n = len(edges) - 1, len(model.columns), model.robot.n
    speed = np.sqrt(np.mean(motion.dq**2, axis=0))
    good = (np.abs(motion.dq) >= SIGN_SPEED_SHARE * speed) & (speed > 1e-9)
    own = [
        np.array([k for k, c in enumerate(model.parameters) if c.friction and c.joint == j + 1], dtype=np.intp)
        for j in range(n)
    ]
    sums = [
        [
            np.zeros((count, size, size)),
            np.zeros((count, size)),
            np.zeros(count),
            np.zeros(count),
            np.zeros((count, len(own[j]))),
        ]
        for j in range(n)
    ]
    starts = np.searchsorted(index, np.arange(count + 1))
    for b in range(count):
        first, rows_in_bin = int(starts[b]), int(starts[b + 1] - starts[b])
        for piece in chunks(rows_in_bin):
            rows = slice(first + piece.start, first + piece.stop)
            Y = model.torque_model.regressor(motion.q[rows], motion.dq[rows], motion.ddq[rows], columns=model.columns)
            for j in range(n):
                mask = good[rows, j]
                Yj, tauj = Y[mask, j], tau[rows, j][mask]
                gram, cross, square, rows_seen, power = sums[j]
                gram[b] += Yj.T @ Yj
                cross[b] += Yj.T @ tauj
                square[b] += tauj @ tauj
                rows_seen[b] += mask.sum()
                power[b] += motion.dq[rows, j] @ Y[:, j][:, own[j]] / rows_in_bin
    return edges, sums
