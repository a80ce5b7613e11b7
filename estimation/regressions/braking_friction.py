"""Friction that brakes: the nearest fit in which it opposes the motion at every speed, seen or not."""

from __future__ import annotations

import numpy as np
from scipy.optimize import nnls

from estimation.regressions.moments import Moments
from estimation.regressions.standard_parameters import nonnegative_rows
from robots.base_parameters import BaseParameters
from robots.common.arrays import Array
from robots.terms import BendingFriction


def with_braking_friction(base: BaseParameters, moments: Moments, values: Array, weights: Array, ridge: float) -> Array:
    """Moves a fit of `BendingFriction` to the nearest one whose friction brakes; any other fit stays as it is.

    The friction of each joint must oppose the motion, must not fall with speed from half of the highest recorded speed
    on, and beyond that speed grows like the viscous part, which must not be negative. Nearest is meant as the data and
    the prior see it: the minimum of the fit's own cost among all that obey.

    Args:
        base: base parameters (b).
        moments: of the data, with the prior.
        values: parameters (b,) of the fit without the constraints.
        weights: of the joints' rows (n,).
        ridge: see `Moments.solve`.
    """
    term = next((term for term in base.model.terms if isinstance(term, BendingFriction)), None)
    if term is None:
        return values
    speed = np.broadcast_to(np.asarray(term.speed, dtype=float), base.model.robot.n)
    columns = np.array([column.friction for column in base.model.columns])
    rows = nonnegative_rows(base.model, speed)
    rows = rows[(rows[:, columns] != 0).any(axis=1)][:, list(base.independent)]
    # A violation below this share of a curve's largest value is rounding.
    if (rows @ values >= -1e-9 * (np.abs(rows) @ np.abs(values))).all():
        return values
    # min (x - values)' A (x - values) with rows x >= 0 has x = values + inv(A) rows' m, and its multipliers m >= 0
    # solve a non-negative least-squares problem (Lawson & Hanson 1974, chapter 23).
    root = np.linalg.cholesky(moments.inverse(weights, ridge))
    multipliers, _ = nnls(root.T @ rows.T, -np.linalg.solve(root, values))
    return np.asarray(values + root @ (root.T @ (rows.T @ multipliers)))
