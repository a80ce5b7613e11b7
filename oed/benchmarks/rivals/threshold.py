"""A threshold on residuals: something is wrong at each joint whose residual is larger than the noise."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from oed.benchmarks.answers.answer import CaseAnswer, NamedEffect
from oed.benchmarks.folders import BlindCase
from oed.benchmarks.rivals.base_model import away_from_reversals, base_columns, filtered, fit, motion_of
from oed.benchmarks.rivals.logs import read_motion
from oed.benchmarks.taxonomy import UNKNOWN

NOISE_FACTOR = 1.6
"""Residual RMS over noise RMS above which something is wrong; chosen on a dozen cases without an effect."""


def by_threshold(case: BlindCase) -> CaseAnswer:
    """Answers a case by a threshold on each joint's residual: `NOISE_FACTOR` times the RMS of the noise in case.json.

    Args:
        case: the public part of the case.
    """
    model = pin.buildModelFromUrdf(str(case.urdf))
    t, q, tau = read_motion(case.log, case.joints, torque=True)
    motion = motion_of(t, q)
    columns = base_columns(model, motion)
    found = fit(filtered(columns, motion.period), filtered(tau, motion.period), away_from_reversals(motion))
    signal = np.sqrt((tau**2).mean(axis=0) / (1 + case.noise**2))
    # The median of squares is hardly affected by rows at reversals, where filtered positions err.
    ratios = typical_size(tau - columns @ found.parameters) / signal / case.noise
    over = np.flatnonzero(ratios > NOISE_FACTOR)
    over = over[np.argsort(-ratios[over])]
    t, q, _ = read_motion(case.unseen, case.joints, torque=False)
    return CaseAnswer(
        verdict="unexplained" if len(over) else "nothing",
        effects=tuple(NamedEffect(effect=UNKNOWN, joints=(int(j) + 1,)) for j in over),
        torque=base_columns(model, motion_of(t, q)) @ found.parameters,
    )


def typical_size(residual: NDArray[np.float64]) -> NDArray[np.float64]:
    """Estimates the standard deviation (n,) of a residual (N, n) by its median absolute value."""
    # Median absolute value of a standard normal variable.
    return np.asarray(np.median(np.abs(residual), axis=0) / 0.6745)
