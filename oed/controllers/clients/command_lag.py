"""How far a robot follows behind its commands, measured while it plays."""

from __future__ import annotations

import numpy as np

from robots.common.arrays import Array
from robots.signals import Motion

LAG_STEP = 0.002
"""Step of the lags that are compared [s]."""


class CommandLag:
    """Finds the lag of each joint between the command that is executed and its position.

    Each row gives the time of the trajectory whose command is executed. The lag is that at which the plan fits the
    positions best, by least squares over all rows.

    Args:
        motion: the plan.
    """

    def __init__(self, motion: Motion) -> None:
        # Longest lag that is compared [s].
        self._lags: Array = np.arange(0.0, 0.4 + LAG_STEP / 2, LAG_STEP)
        count = max(int(np.ceil(motion.duration / LAG_STEP)), 1) + 1
        times = motion.t[0] + LAG_STEP * np.arange(count)
        self._plan = np.column_stack([np.interp(times, motion.t, motion.q[:, j]) for j in range(motion.n)])
        self._misfit = np.zeros((len(self._lags), motion.n))
        # A joint whose plan has less spread has no lag that could be seen [rad or m].
        self._moves = np.ptp(motion.q, axis=0) > 1e-3
        self.rows = 0

    def see(self, executed: float, q: Array) -> None:
        """Takes a row.

        Args:
            executed: time of the trajectory whose command is executed [s].
            q: positions (n,) [rad or m].
        """
        places = np.clip((executed - self._lags) / LAG_STEP, 0, len(self._plan) - 1)
        left = np.minimum(places.astype(int), len(self._plan) - 2)
        share = (places - left)[:, None]
        plan = (1 - share) * self._plan[left] + share * self._plan[left + 1]
        self._misfit += (plan - q) ** 2
        self.rows += 1

    def lags(self) -> list[float | None]:
        """Gives the lag of each joint [s]; None for one that does not move, or before any row."""
        found: list[float | None] = []
        for joint, moves in enumerate(self._moves):
            misfit = self._misfit[:, joint]
            best = int(misfit.argmin())
            if not (moves and self.rows):
                found.append(None)
            elif 0 < best < len(misfit) - 1:
                # The misfit is a parabola around its minimum.
                before, here, after = misfit[best - 1 : best + 2]
                found.append(
                    round(float(self._lags[best] + LAG_STEP * (before - after) / (before - 2 * here + after) / 2), 5)
                )
            else:
                found.append(float(self._lags[best]))
        return found
