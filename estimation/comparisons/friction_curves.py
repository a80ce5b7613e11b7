"""Friction curves of the joints as functions of speed, with pointwise and simultaneous confidence bands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from estimation.comparisons.common_parameters import CommonParameters, friction_table
from estimation.comparisons.runs import Run
from estimation.linear_algebra.scaled import square_root
from estimation.uncertainty.quantiles import NORMAL_95
from robots.common.arrays import Array
from robots.common.records import Record

# Speeds of the curves, as shares of the largest common speed; below the first the width of the sign decides.
SHARES = np.linspace(0.05, 1.0, 40)
# Share of the largest speed at which the thesis follows friction over time (its Figs. 39 and 40).
LEVEL_SPEED_SHARE = 0.6


@dataclass(frozen=True, kw_only=True)
class FrictionCurves(Record):
    """Friction of one joint in all runs.

    Attributes:
        joint: counted from 1.
        speed: velocities (m,) [rad/s or m/s], positive.
        torque: (k, m) [N m or N].
        error: standard errors (k, m).
        difference: from the first run (k, m).
        difference_error: standard errors (k, m), NaN for the first run.
        simultaneous: factor of the standard errors (k,) that holds the whole curve in 95 %; NaN for the first run.
        level: friction at 0.6 of the largest speed (k,).
        level_error: standard errors (k,).
        mean_row: weights (b,) that give the mean friction over the speeds from the parameters.
    """

    ENTRIES = ("joint", "speed", "runs=by_run")

    joint: int
    speed: Array
    torque: Array
    error: Array
    difference: Array
    difference_error: Array
    simultaneous: Array
    level: Array
    level_error: Array
    mean_row: Array

    def by_run(self, labels: Sequence[str]) -> list[dict[str, Any]]:
        """Gives the curves run by run.

        Args:
            labels: of the runs.
        """
        return [
            {
                "run": label,
                "torque": self.torque[k],
                "standard_error": self.error[k],
                "difference": self.difference[k],
                "difference_standard_error": self.difference_error[k],
                "simultaneous_factor95": self.simultaneous[k],
            }
            for k, label in enumerate(labels)
        ]


def common_speeds(runs: Sequence[Run]) -> Array:
    """Largest speed of each joint (n,) that all runs recorded [rad/s or m/s].

    Where a model does not state its speeds, the robot's limit counts, and 1 without a limit.
    """
    found = []
    for run in runs:
        recorded = run.model.provenance.get("recorded")
        limit = np.asarray(run.model.robot.limits.velocity, dtype=float)
        found.append(
            np.asarray(recorded["velocity"][0], dtype=float) if recorded else np.where(np.isfinite(limit), limit, 1.0)
        )
    speeds = np.min(found, axis=0)
    return np.asarray(np.where(speeds > 0, speeds, 1.0))


def friction_curves(runs: Sequence[Run], common: CommonParameters, speeds: Array) -> tuple[FrictionCurves, ...]:
    """Evaluates the friction of each joint that has friction parameters, by the delta method.

    Args:
        runs: the runs.
        common: their parameters in one basis.
        speeds: largest speed of each joint (n,) [rad/s or m/s].
    """
    first = runs[0].model
    names = [column.name for column in common.columns]
    table = friction_table(first, names, speeds, SHARES)
    at_level = friction_table(first, names, speeds, np.array([LEVEL_SPEED_SHARE]))[0]
    found = []
    for joint in range(1, first.robot.n + 1):
        own = [i for i, column in enumerate(common.columns) if column.friction and column.joint == joint]
        if not own:
            continue
        F, x, C = table[:, own], common.values[:, own], common.covariances[:, own][:, :, own]
        rows = np.zeros(len(names))
        rows[own] = F.mean(axis=0)
        sums = C[1:] + C[0]
        changes = [_errors(F, C_) for C_ in sums]
        level = at_level[own]
        found.append(
            FrictionCurves(
                joint=joint,
                speed=SHARES * speeds[joint - 1],
                torque=x @ F.T,
                error=np.array([_errors(F, C_) for C_ in C]),
                difference=(x - x[0]) @ F.T,
                difference_error=np.array([np.full(len(F), np.nan), *changes]),
                simultaneous=np.array([np.nan, *(simultaneous_factor(F, C_) for C_ in sums)]),
                level=x @ level,
                level_error=np.sqrt(np.maximum(np.einsum("i,kij,j->k", level, C, level), 0.0)),
                mean_row=rows,
            )
        )
    return tuple(found)


def simultaneous_factor(rows: Array, covariance: Array, confidence: float = 0.95) -> float:
    """Factor of the pointwise standard errors whose band holds a whole curve F x (sup-t band).

    Args:
        rows: F (m, d).
        covariance: of x (d, d).
        confidence: of the band.

    Source:
        Montiel Olea and Plagborg-Moller 2019.
    """
    scale = _errors(rows, covariance)
    used = scale > 0
    if not used.any():
        return NORMAL_95
    standard = (rows[used] / scale[used, None]) @ square_root(covariance)
    # These draws of the largest standardised deviation give its 95 % point to 2 %.
    draws = np.random.default_rng(0).normal(size=(4000, standard.shape[1]))
    largest = np.abs(draws @ standard.T).max(axis=1)
    return float(np.quantile(largest, confidence))


def _errors(rows: Array, covariance: Array) -> Array:
    return np.asarray(np.sqrt(np.maximum(np.einsum("mi,ij,mj->m", rows, covariance, rows), 0.0)))
