"""The columns of a hypothesis at one shape, measured against the data."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Small = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Group:
    """A hypothesis at one shape, measured against the data.

    Attributes:
        joints: those it acts on, from 0.
        columns: whitened (N, k) of each of the joints.
        against: <X, Q> (k, b), Q the base model's orthonormal columns.
        gram: of what the base model leaves of the columns (k, k).
        raw: squared norms (k,) before that; infinite for columns that are nearly all in rows that do not count.
        cross: with the residual (k,).
        high_band_columns: white columns (N', k) of each of the joints above its band; none for effects that are not
            `independent_of_acceleration`.
        reversal_columns: what each joint's reversals tell of it (n, k), over their errors; None for what is no lag of
            all torque.
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
        """The number of columns k."""
        return len(self.raw)

    @property
    def by_reversals(self) -> bool:
        """Whether most of what tells it are reversals whose rows count neither in a fit nor on unseen data."""
        return self.reversal_columns is not None and 2.0 * float(np.sum(self.reversal_columns**2)) > float(
            self.gram[0, 0]
        )
