"""What the data themselves choose: the smoothing, the sharpness of the friction's sign, the regularisation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add

import numpy as np
from numpy.typing import NDArray

from estimation.estimators import Estimator
from estimation.moments import Moments
from estimation.preparation import Prepared
from robots.base_parameters import BaseParameters

Array = NDArray[np.float64]

# tanh(dq / v0): the first is the sign in practice, and stays unless the data ask for a wider one.
VELOCITY_SCALES = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1)
# Share of its residual that a wider sign must save a joint. Cross-validation would prefer wide ones even where the
# truth is a sign, and bias the friction by many standard errors.
SAVING = 0.03
# How much worse, in mean log error, a smaller ridge or a lower cut-off may be and still be taken.
RIDGE_SLACK, CUTOFF_SLACK = 0.01, 0.0005
# A left-out error below this share of a constant's is rounding.
EXACT = 1e-9
# More rows than this do not choose better, only slower.
MOST_ROWS = 60_000


@dataclass(frozen=True, kw_only=True)
class Candidates:
    """What to choose from.

    Attributes:
        cutoffs: of the smoothing [Hz]; those above 0.4 of the sampling rate are left out.
        ridges: see `Moments.solve`.
        blocks: contiguous pieces of the logs, each predicted from the others.
    """

    cutoffs: tuple[float, ...] = (1.5, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0, 30.0, 50.0)
    ridges: tuple[float, ...] = (1e-8, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2)
    blocks: int = 10


@dataclass(frozen=True, kw_only=True)
class Choice:
    """What was chosen, and how good it was on blocks that the fit had not seen.

    Attributes:
        cutoff: of the smoothing [Hz].
        ridge: of the fit.
        velocity_scales: of each joint's Coulomb column (n,) [rad/s or m/s].
        held_out: RMS of the torque error on blocks left out of the fit (n,) [N m or N].
        spread: standard deviation of the torque (n,): the error of a constant.
    """

    cutoff: float
    ridge: float
    velocity_scales: tuple[float, ...]
    held_out: Array
    spread: Array

    @property
    def cost(self) -> float:
        """Mean log of the error relative to a constant, a joint worse than a constant counting as one."""
        return float(np.log(np.clip(self.held_out / self.spread, EXACT, 1.0)).mean())


def choose(base: BaseParameters, logs: Sequence[Prepared], estimator: Estimator, candidates: Candidates) -> Choice:
    """Compares all candidates by cross-validation over contiguous blocks.

    Args:
        base: base parameters of the model whose friction uses the first of `VELOCITY_SCALES`.
        logs: the data.
        estimator: what will fit.
        candidates: what to choose from.

    Returns:
        The smallest ridge, then the lowest cut-off, that is as good as the best.
    """
    tau = np.concatenate([log.tau for log in logs])
    spread = np.maximum(tau.std(axis=0), 1e-9 * np.maximum(1.0, np.abs(tau).max(axis=0)))
    rate = 1 / float(np.median([log.positions.period for log in logs]))
    usable = [cutoff for cutoff in candidates.cutoffs if cutoff <= 0.4 * rate] or [0.4 * rate]
    tried = []
    for cutoff in usable:
        blocks = _blocks(base, logs, cutoff, candidates.blocks)
        tried += [_try(base, blocks, cutoff, ridge, spread, estimator) for ridge in candidates.ridges]
    best = min(choice.cost for choice in tried)
    for ridge in sorted(candidates.ridges):
        of_ridge = [choice for choice in tried if choice.ridge == ridge]
        lowest = min(choice.cost for choice in of_ridge)
        if lowest <= best + RIDGE_SLACK:
            return min((c for c in of_ridge if c.cost <= lowest + CUTOFF_SLACK), key=lambda c: c.cutoff)
    raise AssertionError("the best candidate is as good as the best")


def _blocks(base: BaseParameters, logs: Sequence[Prepared], cutoff: float, count: int) -> list[Moments]:
    """Moments of each block, the sign columns of the wider scales appended after the base columns."""
    rows = sum(len(log.log) for log in logs)
    stride = max(1, rows // MOST_ROWS)
    blocks = []
    for log in logs:
        part = log.rows(cutoff, stride)
        motion = part.motion
        Y = base.regressor(motion.q, motion.dq, motion.ddq)
        joints = motion.n
        wide = np.zeros((len(motion), joints, joints, len(VELOCITY_SCALES) - 1))
        diagonal = np.arange(joints)
        for k, scale in enumerate(VELOCITY_SCALES[1:]):
            wide[:, diagonal, diagonal, k] = np.tanh(motion.dq / scale)
        Y = np.concatenate([Y, wide.reshape(len(motion), joints, -1)], axis=2)
        pieces = max(1, round(count * len(log.log) / rows))
        for piece in np.array_split(np.arange(len(motion)), pieces):
            blocks.append(Moments.of(Y[piece], part.tau[piece], part.mask[piece]))
    return blocks


def _try(
    base: BaseParameters,
    blocks: list[Moments],
    cutoff: float,
    ridge: float,
    spread: Array,
    estimator: Estimator,
) -> Choice:
    total = reduce(add, blocks)
    scales = _scales(base, total, ridge, estimator)
    columns = _columns(base, scales)
    total, parts = total.columns(columns), [block.columns(columns) for block in blocks]
    _, weights = estimator.solve(total, ridge)
    error = np.zeros_like(spread)
    for part in parts:
        rest = total - part if len(parts) > 1 else total
        error += part.residual(rest.solve(weights, ridge))
    return Choice(
        cutoff=cutoff,
        ridge=ridge,
        velocity_scales=tuple(VELOCITY_SCALES[k] for k in scales),
        held_out=np.sqrt(error / np.maximum(total.count, 1)),
        spread=spread,
    )


def _scales(base: BaseParameters, total: Moments, ridge: float, estimator: Estimator) -> list[int]:
    """Per joint the index of its velocity scale: the widest saving, if it is worth it."""
    joints = len(total.count)
    errors = np.empty((len(VELOCITY_SCALES), joints))
    for k in range(len(VELOCITY_SCALES)):
        moments = total.columns(_columns(base, [k] * joints))
        errors[k] = moments.residual(moments.solve(np.ones(joints), ridge))
    worth = errors.min(axis=0) < (1 - SAVING) ** 2 * errors[0]
    return [int(k) if yes else 0 for k, yes in zip(errors.argmin(axis=0), worth, strict=True)]


def _columns(base: BaseParameters, scales: Sequence[int]) -> NDArray[np.intp]:
    chosen = np.arange(base.size)
    extra = len(VELOCITY_SCALES) - 1
    for position, column in enumerate(base.columns):
        scale = scales[column.joint - 1] if column.symbol == "f1" else 0
        if scale:
            chosen[position] = base.size + (column.joint - 1) * extra + scale - 1
    return chosen
