"""Normal equations whose parameters have very different scales."""

from __future__ import annotations

import numpy as np

from estimation.linear_algebra.scaled import LEAST_RIDGE, solve_ridge
from robots.common.arrays import Array


def inverse_of(information: Array) -> Array:
    """Inverts an information matrix.

    Args:
        information: (p, p), symmetric and positive semidefinite.

    Returns:
        The covariance (p, p). A parameter about which the logs say nothing has an infinite variance.
    """
    # Information below which a parameter acts on no torque; its variance would overflow.
    known = np.diag(information) > 1e-280
    inverse = np.diag(np.where(known, 0.0, np.inf))
    inside = np.ix_(known, known)
    inverse[inside] = solve_ridge(information[inside], np.eye(int(known.sum())), LEAST_RIDGE)
    return inverse
