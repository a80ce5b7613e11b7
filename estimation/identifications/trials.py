"""The settings to choose from, each one's left-out errors, and the ridge that these leave to choose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimation.regressions.parameter_priors import GaussianPrior

Array = NDArray[np.float64]

# How much worse, in mean log error, a smaller ridge may be and still be taken.
RIDGE_SLACK = 0.01


@dataclass(frozen=True, kw_only=True)
class Candidates:
    """Candidates of the cross-validation.

    Attributes:
        cutoffs: of the smoothing [Hz]; those above 0.4 of the sampling rate are left out.
        ridges: see `Moments.solve`.
        blocks: contiguous pieces of the logs, each predicted from the others.
        smoothers: which smoothers besides the low-pass: ``spline``, and ``harmonics`` where the motion is periodic.
        pull: whether the regularisation may use the robot's description as prior.
        period: of the motion [s] where it is known; None leaves it to the log.
    """

    cutoffs: tuple[float, ...] = (1.5, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0, 30.0, 50.0)
    ridges: tuple[float, ...] = (1e-8, 1e-7, 1e-6, 1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 1e-2)
    blocks: int = 10
    smoothers: tuple[str, ...] = ("spline", "harmonics")
    pull: bool = True
    period: float | None = None


@dataclass(frozen=True)
class Trial:
    """One setting: its ridge and pull, each joint's index into the velocity scales, and its left-out errors."""

    ridge: float
    pull: GaussianPrior | None
    scales: tuple[int, ...]
    logs: Array  # of the errors (n,) relative to a constant

    @property
    def cost(self) -> float:
        """Mean log of the errors relative to a constant, a joint worse than a constant counting as one."""
        return float(np.minimum(self.logs, 0.0).mean())


def smallest(trials: Sequence[Trial]) -> Trial:
    """The smallest ridge that is as good as the best; the trials come with ascending ridges."""
    best = min(trial.cost for trial in trials)
    return next(trial for trial in trials if trial.cost <= best + RIDGE_SLACK)


def strongest(trials: Sequence[Trial]) -> Trial:
    """The largest ridge that is as good as the best: another motion asks for more than blocks of the same one do.

    Of a pull towards zero the smallest is taken, which biases least; a description is where open directions belong.
    """
    best = min(trial.cost for trial in trials)
    return [trial for trial in trials if trial.cost <= best + RIDGE_SLACK][-1]
