"""Normal equations whose parameters have very different scales."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimation.linear_algebra.scaled import solve_ridge

Array = NDArray[np.float64]

# Least regularisation that keeps the inverse finite.
FAINT = 1e-12
# Information below which a parameter acts on no torque; its variance would overflow.
SILENT = 1e-280


def inverse_of(information: Array) -> Array:
    """Inverts an information matrix.

    Args:
        information: (p, p), symmetric and positive semidefinite.

    Returns:
        The covariance (p, p). A parameter about which the logs say nothing has an infinite variance.
    """
    known = np.diag(information) > SILENT
    inverse = np.diag(np.where(known, 0.0, np.inf))
    inside = np.ix_(known, known)
    inverse[inside] = solve_ridge(information[inside], np.eye(int(known.sum())), FAINT)
    return inverse
