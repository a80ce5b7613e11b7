"""What the data choose from, and the setting that a choice tries."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimation.regressions.parameter_priors import GaussianPrior
from robots.common.arrays import Array


@dataclass(frozen=True, kw_only=True)
class Candidates:
    """Candidates of the choice.

    Attributes:
        cutoffs: of the smoothing [Hz]; those above 0.4 of the sampling rate are left out.
        blocks: contiguous pieces of the logs, each predicted from others.
        smoothers: which smoothers besides the low-pass: ``spline``, and ``harmonics`` where the motion is periodic.
        period: of the motion [s] where it is known; None leaves it to the log.
    """

    cutoffs: tuple[float, ...] = (1.5, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0, 30.0, 50.0)
    blocks: int = 12
    smoothers: tuple[str, ...] = ("spline", "harmonics")
    period: float | None = None


@dataclass(frozen=True)
class Trial:
    """One setting.

    Attributes:
        ridge: weight of the prior, see `Moments.solve`.
        prior: of the parameters (k).
        columns: indices of the k base parameters that it has.
        scales: each joint's index into the velocity scales.
        logs: logarithms of the left-out errors (n,) relative to a constant.
    """

    ridge: float
    prior: GaussianPrior
    columns: tuple[int, ...]
    scales: tuple[int, ...]
    logs: Array

    @property
    def cost(self) -> float:
        """Mean log of the errors relative to a constant, a joint worse than a constant counting as one."""
        return float(np.minimum(self.logs, 0.0).mean())
