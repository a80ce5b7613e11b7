"""Whitened columns of a hypothesis at one shape, and their inner products."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Small = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Group:
    """A hypothesis at one shape, whitened, with the base model projected out of its inner products.

    Attributes:
        joints: joints on which it acts, from 0.
        columns: whitened columns (N, k) of each of the joints.
        against: <X, Q> (k, b), Q the base model's orthonormal columns.
        gram: Gram matrix of the columns (k, k), base model projected out.
        raw: squared norms (k,) before the projection; infinite for columns that are nearly all in masked rows.
        cross: inner products with the residual (k,).
        high_band_columns: white columns (N', k) of each joint above its band; none for effects that are not
            `independent_of_acceleration`.
        reversal_columns: column of each joint's reversal timing over its error (n, k); None if the effect does not
            delay all torque.
    """

    joints: tuple[int, ...]
    columns: tuple[Small, ...]
    against: Array
    gram: Array
    raw: Array
    cross: Array
    high_band_columns: tuple[Small, ...] = ()
    reversal_columns: Array | None = None

    @property
    def size(self) -> int:
        """Number of columns k."""
        return len(self.raw)

    @property
    def by_reversals(self) -> bool:
        """Whether most of its information is from reversal timing, which held-out errors do not contain."""
        return self.reversal_columns is not None and 2.0 * float(np.sum(self.reversal_columns**2)) > float(
            self.gram[0, 0]
        )
