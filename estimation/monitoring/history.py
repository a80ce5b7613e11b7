"""What a report draws: friction of each joint over time, with the part that temperature explains."""

from __future__ import annotations

import numpy as np

from robots.common.arrays import Array


class History:
    """Rows over time; old ones are averaged in pairs, so that a year needs no more room than a week.

    Columns: start, end and number of the log, then for each joint the log of its friction over the model's, its
    standard error, the part that temperature explains, and the rest; last the misfit.

    Args:
        n: number of joints.
    """

    def __init__(self, n: int) -> None:
        self.n = n
        self.rows: list[list[float]] = []

    def add(
        self, start: float, end: float, log: int, friction: Array, error: Array, heat: Array, rest: Array, misfit: float
    ) -> None:
        """Adds a window; see the class for the arguments, (n,) each."""
        self.rows.append([start, end, float(log), *friction, *error, *heat, *rest, misfit])
        most = 6000
        if len(self.rows) > most:
            half = most // 2
            old = np.array(self.rows[:half])
            merged = (old[::2] + old[1::2]) / 2
            merged[:, 0], merged[:, 1], merged[:, 2] = old[::2, 0], old[1::2, 1], old[1::2, 2]
            self.rows[:half] = merged.tolist()

    def table(self) -> dict[str, Array]:
        """Gives the columns: start, end, log, misfit (N,), and friction, error, heat and rest (N, n)."""
        n = self.n
        data = np.array(self.rows, dtype=float).reshape(len(self.rows), 4 + 4 * n)
        names = ("friction", "error", "heat", "rest")
        return {
            "start": data[:, 0],
            "end": data[:, 1],
            "log": data[:, 2],
            "misfit": data[:, -1],
            **{name: data[:, 3 + k * n : 3 + (k + 1) * n] for k, name in enumerate(names)},
        }
