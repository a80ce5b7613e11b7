"""The regressor joint by joint, chunk by chunk: never the whole of it, and none of its zeros."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache, reduce

import casadi
import numpy as np
from numpy.typing import NDArray

from estimation.regressions.moments import Moments
from robots.base_parameters import BaseParameters
from robots.batch import BatchFunction, batch_function
from robots.common.arrays import Array
from robots.regressor import TorqueModel


@dataclass(frozen=True)
class JointRegressor:
    """Y_b split into each joint's own columns.

    A joint feels the links from itself outwards and its own friction: less than half of the columns on average. Under
    another gravity than the description's it may feel more of them.

    Attributes:
        base: the base parameters.
    """

    base: BaseParameters

    @cached_property
    def used(self) -> tuple[NDArray[np.intp], ...]:
        """Which columns act on each joint under any of the base's gravities: n arrays of indices."""
        base = self.base
        own = [_acting(base.model.under(gravity), base.independent) for gravity in (None, *base.gravities)]
        return tuple(reduce(np.union1d, columns).astype(np.intp) for columns in zip(*own, strict=True))

    @cached_property
    def _asked(self) -> tuple[tuple[int, ...], ...]:
        return tuple(tuple(columns.tolist()) for columns in self.used)

    def __call__(self, q: Array, dq: Array, ddq: Array, gravity: Array | None = None) -> tuple[Array, ...]:
        """Evaluates each joint's rows, n arrays (N, p_j), under another gravity (3,) of the base's where given."""
        return tuple(part[:, 0] for part in self._rows(gravity)(q, dq, ddq))

    def sums(self, q: Array, dq: Array, ddq: Array, size: int, gravity: Array | None = None) -> tuple[Array, ...]:
        """Sums each joint's rows over groups of `size` samples: n arrays (N / size, p_j)."""
        return tuple(part[:, 0] for part in self._rows(gravity).sums(q, dq, ddq, size=size))

    def counted(
        self, q: Array, dq: Array, ddq: Array, mask: Array, size: int, gravity: Array | None = None
    ) -> list[Array]:
        """Sums each joint's rows as they count, by the mask (N, n), over groups: n arrays (N / size, p_j)."""
        sums = self.sums(q, dq, ddq, size, gravity)
        # Few rows do not count in full: theirs are taken off again.
        slow = np.flatnonzero((mask != 1).any(axis=1))
        for joint, rows in enumerate(self(q[slow], dq[slow], ddq[slow], gravity)):
            places, lost = summed(rows * (1 - mask[slow, joint, None]), slow // size)
            sums[joint][places] -= lost
        return list(sums)

    def _rows(self, gravity: Array | None) -> BatchFunction:
        """The evaluator under a gravity, at hand without comparing models."""
        key = None if gravity is None else tuple(gravity)
        if key not in self._evaluators:
            model = self.base.model.under(gravity)
            self._evaluators[key] = _joint_rows(model, self.base.independent, self._asked)
        return self._evaluators[key]

    @cached_property
    def _evaluators(self) -> dict[tuple[float, ...] | None, BatchFunction]:
        return {}

    def moments(
        self, q: Array, dq: Array, ddq: Array, tau: Array, mask: Array, gravity: Array | None = None
    ) -> Moments:
        """Sums the normal equations of some samples (N, n), each counting by the mask (N, n), 0 to 1."""
        n, p = tau.shape[1], self.base.size
        gram, cross = np.zeros((n, p, p)), np.zeros((n, p))
        for joint, (rows, used) in enumerate(zip(self(q, dq, ddq, gravity), self.used, strict=True)):
            weight = np.sqrt(mask[:, joint])
            # Few rows do not count in full.
            part = np.flatnonzero(weight != 1)
            rows[part] *= weight[part, None]
            gram[joint][np.ix_(used, used)] = rows.T @ rows
            cross[joint, used] = rows.T @ (weight * tau[:, joint])
        return Moments(gram, cross, (mask * tau**2).sum(axis=0), mask.sum(axis=0, dtype=float))

    def torque(self, q: Array, dq: Array, ddq: Array, parameters: Array) -> Array:
        """Evaluates tau = Y_b pi_b (N, n) for base parameters (b,)."""
        rows = self(q, dq, ddq)
        return np.stack([y @ parameters[used] for y, used in zip(rows, self.used, strict=True)], axis=1)


@lru_cache(maxsize=16)
def _acting(model: TorqueModel, independent: tuple[int, ...]) -> tuple[NDArray[np.intp], ...]:
    """Which columns act on each joint under the model's gravity."""
    rows, columns = (np.asarray(part) for part in model.symbolic(independent).sparsity_out(0).get_triplet())
    return tuple(np.sort(columns[rows == joint]).astype(np.intp) for joint in range(model.robot.n))


@lru_cache(maxsize=16)
def _joint_rows(model: TorqueModel, independent: tuple[int, ...], used: tuple[tuple[int, ...], ...]) -> BatchFunction:
    """Builds the evaluator, kept: the choice, the fit and its residuals ask for the same one."""
    inputs = [casadi.SX.sym(name, model.robot.n) for name in ("q", "dq", "ddq")]
    Y = model.symbolic(independent)(*inputs)
    parts = [casadi.densify(Y[joint, list(columns)]) for joint, columns in enumerate(used)]
    return batch_function(casadi.Function("joint_rows", inputs, parts), "auto")


def summed(rows: Array, groups: NDArray[np.intp]) -> tuple[NDArray[np.intp], Array]:
    """Sums rows (M, k) of the same group, the groups (M,) in ascending order.

    Returns:
        The groups that there are (P,), and their sums (P, k).
    """
    if not len(groups):
        return groups, rows
    starts = np.flatnonzero(np.diff(groups, prepend=-1))
    return groups[starts], np.add.reduceat(rows, starts)
