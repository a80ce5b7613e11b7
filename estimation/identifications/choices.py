"""Choices that the data make: smoothing, sharpness of the friction's sign, and a torque by position."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimation.estimators import Estimator
from estimation.identifications.comparison import VELOCITY_SCALES, Comparison
from estimation.identifications.transfer import Band, Contradiction, Transfer
from estimation.identifications.trials import Candidates
from estimation.preprocessing import Smoother
from estimation.regressions.parameter_priors import GaussianPrior
from estimation.regressions.preparation import Prepared
from robots.base_parameters import BaseParameters
from robots.common.arrays import Array

__all__ = ["VELOCITY_SCALES", "Candidates", "Choice", "choose"]


@dataclass(frozen=True, kw_only=True)
class Choice:
    """The chosen settings and their error on held-out blocks.

    Attributes:
        smoother: of the positions.
        low_pass: cut-off [Hz] of the low-pass that suits the logs best: of the prediction of other motions, which do
            not have the harmonics of these.
        ridge: weight of the prior, see `Moments.solve`.
        velocity_scales: of each joint's Coulomb column (n,) [rad/s or m/s].
        prior: of the base parameters.
        position: whether the model has a torque by each joint's position.
        held_out: RMS of the torque error on blocks left out of the fit (n,) [N m or N], on all rows in which the joint
            is not at rest: those of a prediction.
        without_position: the same without a torque by position (n,), if the model has one; None otherwise.
        spread: standard deviation of the torque (n,): the error of a constant.
        band: of the prediction of other motions.
        contradiction: a log that one model does not fit together with the others; None where they agree.
        cost: mean log of the left-out error over that of a constant; a joint worse than a constant counts as one.
    """

    smoother: Smoother
    low_pass: float
    ridge: float
    velocity_scales: tuple[float, ...]
    prior: GaussianPrior
    position: bool
    held_out: Array
    without_position: Array | None = None
    spread: Array
    band: Band
    contradiction: Contradiction | None
    cost: float

    @property
    def cutoff(self) -> float:
        """Of the smoothing [Hz]."""
        return self.smoother.cutoff


def choose(
    base: BaseParameters,
    logs: Sequence[Prepared],
    estimator: Estimator,
    candidates: Candidates,
    *,
    position: bool | None = None,
    spread: Array | None = None,
) -> Choice:
    """Chooses by predicting parts of the logs from others.

    The smoothing is the one that predicts contiguous blocks best, the low-pass unless another is clearly better. What
    the model has in addition is judged on parts that are other motions (`Transfer`).

    Args:
        base: base parameters of the model whose friction uses the first of `VELOCITY_SCALES`.
        logs: the data.
        estimator: what will fit.
        candidates: what to choose from.
        position: whether a `PositionTorque` of the base stays. None: where it predicts other motions clearly better.
        spread: standard deviation of the torque (n,), where the logs are parts of a longer one; None for that of the
            logs.
    """
    comparison = Comparison(base, logs, estimator, candidates, spread)
    smoother, low_pass = comparison.smoother()
    averaged, logged = comparison.blocks(smoother), comparison.blocks(smoother, 1)
    transfer = Transfer(comparison, smoother)
    plain = trial = comparison.trial(averaged)
    if position is not False and len(comparison.plain) < base.size:
        other = comparison.trial(averaged, position=True)
        # Decrease of the error on other motions (mean log) that a torque by position must bring.
        if position or transfer.cost(averaged, other) < transfer.cost(averaged, trial) - 0.03:
            trial, position = other, True
    held_out = comparison.left_out(logged, trial)
    return Choice(
        smoother=smoother,
        low_pass=low_pass.cutoff,
        ridge=trial.ridge,
        velocity_scales=tuple(VELOCITY_SCALES[k] for k in trial.scales),
        prior=trial.prior,
        position=bool(position),
        held_out=held_out,
        without_position=comparison.left_out(logged, plain) if position else None,
        spread=comparison.spread,
        band=transfer.band(averaged, trial),
        contradiction=transfer.contradiction(averaged, trial),
        cost=float(np.minimum(np.log(np.maximum(held_out / comparison.spread, 1e-9)), 0.0).mean()),
    )
