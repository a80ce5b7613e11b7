"""The regressor joint by joint, chunk by chunk: never the whole of it, and none of its zeros."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import islice
from typing import TypeVar

import casadi
import numpy as np
from numpy.typing import NDArray

from estimation.moments import Moments
from robots.base_parameters import BaseParameters
from robots.batch import BatchFunction, batch_function
from robots.common.parallel import available_cores
from robots.regressor import TorqueModel

Array = NDArray[np.float64]
Item = TypeVar("Item")
Result = TypeVar("Result")

CHUNK = 2048
# More threads than this wait for memory.
MOST_THREADS = 4


@dataclass(frozen=True)
class JointRegressor:
    """Y_b split into each joint's own columns.

    A joint feels the links from itself outwards and its own friction: less than half of the columns on average.

    Attributes:
        base: the base parameters.
    """

    base: BaseParameters

    @cached_property
    def used(self) -> tuple[NDArray[np.intp], ...]:
        """Which columns act on each joint: n arrays of indices into the base parameters."""
        return self._rows[0]

    @cached_property
    def _rows(self) -> tuple[tuple[NDArray[np.intp], ...], BatchFunction]:
        return _joint_rows(self.base.model, tuple(self.base.independent))

    def __call__(self, q: Array, dq: Array, ddq: Array) -> tuple[Array, ...]:
        """Evaluates each joint's rows: n arrays (N, p_j)."""
        rows = self._rows[1](q, dq, ddq)
        return tuple(part.reshape(len(q), -1) for part in rows)

    def moments(self, q: Array, dq: Array, ddq: Array, tau: Array, mask: Array) -> Moments:
        """Sums the normal equations of some samples (N, n), each counting by the mask (N, n), 0 to 1."""
        n, p = tau.shape[1], self.base.size
        gram, cross = np.zeros((n, p, p)), np.zeros((n, p))
        for joint, (rows, used) in enumerate(zip(self(q, dq, ddq), self.used, strict=True)):
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


@lru_cache(maxsize=4)
def _joint_rows(model: TorqueModel, independent: tuple[int, ...]) -> tuple[tuple[NDArray[np.intp], ...], BatchFunction]:
    """Builds the evaluator, kept: the choice, the fit and its residuals ask for the same one."""
    n = model.robot.n
    symbolic = model.symbolic(independent)
    rows, columns = (np.asarray(part) for part in symbolic.sparsity_out(0).get_triplet())
    used = tuple(np.sort(columns[rows == joint]).astype(np.intp) for joint in range(n))
    inputs = [casadi.SX.sym(name, n) for name in ("q", "dq", "ddq")]
    Y = symbolic(*inputs)
    parts = [casadi.densify(Y[joint, columns.tolist()]) for joint, columns in enumerate(used)]
    return used, batch_function(casadi.Function("joint_rows", inputs, parts), "auto")


def chunks(rows: int, size: int = CHUNK) -> Iterator[slice]:
    """Cuts so many rows into slices."""
    for start in range(0, rows, size):
        yield slice(start, min(start + size, rows))


def threaded(function: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
    """Applies a function on some threads and gives the results in order, a few ahead of who takes them.

    Compiled code, linear algebra and filters leave Python's lock; sums taken in order come out alike on any machine.
    """
    threads = min(available_cores(), MOST_THREADS)
    if threads == 1:
        yield from map(function, items)
        return
    queue = iter(items)
    with ThreadPoolExecutor(threads) as pool:
        pending = [pool.submit(function, item) for item in islice(queue, 2 * threads)]
        try:
            while pending:
                result = pending.pop(0).result()
                pending.extend(pool.submit(function, item) for item in islice(queue, 1))
                yield result
        finally:
            for future in pending:
                future.cancel()
