"""Limits in space on a whole experiment, between its samples too."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from oed.constraints import StateLimits
from oed.constraints.geometric import GeometricLimits
from robots.signals import Motion


@dataclass(frozen=True, kw_only=True)
class SpatialMargin:
    """How near a motion comes to one limit in space.

    Attributes:
        limit: its name.
        unit: of the value.
        value: the smallest distance to the bound at the samples, negative beyond it.
        between: by how much less it may be between the samples.
        time: of the smallest value [s].
    """

    limit: str
    unit: str
    value: float
    between: float
    time: float

    @property
    def violated(self) -> bool:
        """Whether the limit is passed, or not proved to be kept."""
        return self.value - self.between < 0


@dataclass(frozen=True)
class SpatialCheck:
    """Measures a motion against limits in space.

    Between two samples a twice differentiable g(t) stays above the lower of both by all but h^2 / 8 max |g''|; the
    second differences of the samples, doubled for what g'' does between them, stand for h^2 g''.

    Attributes:
        limits: the limits, those on collisions left to their own proof.
    """

    limits: GeometricLimits

    def margins(self, motion: Motion) -> tuple[SpatialMargin, ...]:
        """Gives the closest approach to each limit."""
        values = self.limits.values(motion.q, motion.dq, motion.ddq)
        bends = np.abs(np.diff(values, n=2, axis=0)).max(axis=0, initial=0.0) / 4
        rows = values.argmin(axis=0)
        return tuple(
            SpatialMargin(
                limit=label,
                unit=unit,
                value=float(values[row, column]),
                between=float(bends[column]),
                time=float(motion.t[row]),
            )
            for column, (label, unit, row) in enumerate(zip(self.limits.labels, self.limits.units, rows, strict=True))
        )

    def broken(self, motion: Motion) -> tuple[float, str] | None:
        """When a motion breaks a limit most, and which; None where it keeps all."""
        wrong = [margin for margin in self.margins(motion) if margin.violated]
        if not wrong:
            return None
        worst = min(wrong, key=lambda margin: margin.value - margin.between)
        return (
            worst.time,
            f"breaks the limit {worst.limit!r} by {worst.between - worst.value:.3g} {worst.unit}".rstrip(),
        )


def motion_margins(limits: StateLimits, motion: Motion) -> tuple[SpatialMargin, ...]:
    """Gives the closest approach to each limit of motion at the samples, as a share of its bound."""
    values = 1 - np.abs(limits.values(motion.q, motion.dq, motion.ddq))
    rows = values.argmin(axis=0)
    return tuple(
        SpatialMargin(
            limit=label,
            unit="of its bound",
            value=float(values[row, column]),
            between=0.0,
            time=float(motion.t[row]),
        )
        for column, (label, row) in enumerate(zip(limits.labels, rows, strict=True))
    )
