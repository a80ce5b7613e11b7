"""Result of the collision check of a motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robots.common.arrays import Array


@dataclass(frozen=True, eq=False)
class CollisionReport:
    """The smallest clearances along a motion.

    Attributes:
        names: of the P pairs.
        clearance: the smallest found for each pair, negative where bodies overlap (P,) [m].
        time: when [s], (P,).
        lower_bound: what is proved of each pair for all times (P,) [m].
        margin: that was to be kept [m].
        certified: whether every pair is proved to keep the margin at all times.
        evaluations: poses looked at.
        disagreement: by how much coal differed at the samples [m]; None if it was not asked.
        by_shape: names of the pairs of links that drawn shapes judge, at the samples.
        meetings: those of them whose shapes meet, and when first [s].
    """

    names: tuple[str, ...]
    clearance: Array
    time: Array
    lower_bound: Array
    margin: float
    certified: bool
    evaluations: int
    disagreement: float | None
    by_shape: tuple[str, ...] = ()
    meetings: tuple[tuple[str, float], ...] = ()

    @property
    def collides(self) -> bool:
        """Whether a pair was found to fall below the margin, or drawn shapes meet."""
        return bool((self.clearance < self.margin).any() or self.meetings)

    @property
    def confirmed(self) -> bool | None:
        """Whether coal found the same distances; None if it was not asked."""
        # By how much coal's distances may differ [m]: its iterative solver ends at 1e-6.
        return None if self.disagreement is None else self.disagreement <= 1e-5

    @property
    def worst(self) -> int | None:
        """Index of the closest pair; None without any pair."""
        return int(np.argmin(self.clearance)) if len(self.names) else None

    def summary(self) -> str:
        """Says in a few lines whether the motion is free, and what comes closest when."""
        if self.worst is None and not self.by_shape:
            return "no pair of bodies to check"
        state = "proved free of collisions at all times" if self.certified else "not proved between samples"
        if self.collides:
            state = "not free"
        lines = [f"{state}, margin {1e3 * self.margin:.1f} mm, {self.evaluations} poses"]
        for index in np.argsort(self.clearance)[:3]:
            lines.append(
                f"  {self.names[index]}: {1e3 * self.clearance[index]:.1f} mm at {self.time[index]:.3f} s"
                f" (proved: {1e3 * self.lower_bound[index]:.1f} mm)"
            )
        lines += [f"  {name}: their drawn shapes meet at {time:.3f} s" for name, time in self.meetings]
        if self.disagreement is not None:
            lines.append(f"coal differs by {1e6 * self.disagreement:.1f} um at most")
        return "\n".join(lines)
