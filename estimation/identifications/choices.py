"""Choices by cross-validation: smoothing, sharpness of the friction's sign, regularisation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimation.estimators import Estimator
from estimation.identifications.comparison import VELOCITY_SCALES, Comparison
from estimation.identifications.trials import Candidates
from estimation.preprocessing import Smoother
from estimation.regressions.parameter_priors import GaussianPrior
from estimation.regressions.preparation import Prepared
from robots.base_parameters import BaseParameters

Array = NDArray[np.float64]

__all__ = ["VELOCITY_SCALES", "Candidates", "Choice", "choose"]


@dataclass(frozen=True, kw_only=True)
class Choice:
    """The chosen settings and their error on held-out blocks.

    Attributes:
        smoother: of the positions.
        ridge: of the fit.
        velocity_scales: of each joint's Coulomb column (n,) [rad/s or m/s].
        pull: what the ridge pulls to; None for zero.
        held_out: RMS of the torque error on blocks left out of the fit (n,) [N m or N], joints at rest and the logs'
            ends besides: what a prediction is judged on.
        spread: standard deviation of the torque (n,): the error of a constant.
        band: half-width (n,) [N m or N] of a band that holds 95 % of the left-out errors.
        band_coverage: share (n,) of each block's errors within the band that the other blocks' errors give.
        cost: mean log of the left-out error over that of a constant; a joint worse than a constant counts as one.
        plain: the choice with the smallest ridge and no pull, which biases nothing; None where this is it.
    """

    smoother: Smoother
    ridge: float
    velocity_scales: tuple[float, ...]
    pull: GaussianPrior | None
    held_out: Array
    spread: Array
    band: Array
    band_coverage: Array
    cost: float
    plain: Choice | None = None

    @property
    def cutoff(self) -> float:
        """Of the smoothing [Hz]."""
        return self.smoother.cutoff


def choose(base: BaseParameters, logs: Sequence[Prepared], estimator: Estimator, candidates: Candidates) -> Choice:
    """Compares candidates by cross-validation over contiguous blocks: smoothing first, then regularisation.

    Args:
        base: base parameters of the model whose friction uses the first of `VELOCITY_SCALES`.
        logs: the data.
        estimator: what will fit.
        candidates: what to choose from.

    Returns:
        The low-pass unless another smoother is clearly better; the smallest ridge, then the lowest cut-off, that is as
        good as the best; a pull towards the description where it clearly helps.
    """
    comparison = Comparison(base, logs, estimator, candidates)
    smoother = comparison.smoother()
    # On the logged torque: a ridge causes bias, so its gain must be significant.
    blocks = comparison.blocks(smoother, 1)
    choices: list[Choice] = []
    for trial in comparison.regularisation(blocks):
        if choices and trial.ridge == choices[0].ridge and trial.pull is None:
            return choices[0]
        band, covered = comparison.band(smoother, blocks, trial)
        choices.append(
            Choice(
                smoother=smoother,
                ridge=trial.ridge,
                velocity_scales=tuple(VELOCITY_SCALES[k] for k in trial.scales),
                pull=trial.pull,
                held_out=np.exp(trial.logs) * comparison.spread,
                spread=comparison.spread,
                band=band,
                band_coverage=covered,
                cost=trial.cost,
            )
        )
    plain, best = choices
    return replace(best, plain=plain)
