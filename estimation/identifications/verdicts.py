"""Which joints and parameters a fit determines."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from estimation.identifications.choices import Choice
from estimation.identifications.estimate import JointFit
from estimation.identifications.fit import Fit
from robots.common.arrays import Array
from robots.common.errors import NotIdentifiableError

# A parameter is determined when its standard error is below this share of it ...
DETERMINED_ERROR = 0.5
# ... or when the torque that its standard error makes is below this share of every joint's torque: it is then known
# to be too small to matter.
NEGLIGIBLE_TORQUE = 0.02


def require_predictable(moves: NDArray[np.bool_], lowest: Array, highest: Array, choice: Choice) -> NDArray[np.bool_]:
    """Marks the joints (n,) that move, and have a torque that varies and follows from the motion.

    Args:
        moves: which joints move (n,).
        lowest: torque (n,) [N m or N].
        highest: torque (n,).
        choice: with the errors on held-out data.

    Raises:
        NotIdentifiableError: none.
    """
    # A torque that varies by less than this share of its size, or of 1 N m, is constant but for rounding.
    varies = highest - lowest > 1e-9 * np.maximum(1.0, np.maximum(highest, -lowest))
    # A joint whose left-out torque is predicted hardly better than by a constant is not identified.
    follows = choice.held_out < 0.95 * choice.spread
    if (moves & varies & follows).any():
        return np.asarray(moves & varies & follows)
    if not varies.any():
        raise NotIdentifiableError(
            "no joint's torque varies", remedy="record the torque of the moving arm, and check the meaning of tau1.."
        )
    raise NotIdentifiableError(
        "no joint's torque can be predicted from its motion",
        allowed="held-out torque errors below the torque's standard deviation",
        remedy="check units and signs of q and tau, and that the arm moves",
    )


def determined_parameters(found: Fit, joints: Sequence[JointFit]) -> NDArray[np.bool_]:
    """Finds which parameters (b,) the data determine: by their standard errors, or because they hardly matter."""
    values, moments, columns = found.solution.values, found.moments, found.base.columns
    errors = np.sqrt(np.maximum(np.diag(found.covariance), 0.0))
    excited = np.einsum("jpp->jp", moments.gram) / np.maximum(moments.count, 1)[:, None]  # mean square of each column
    torque = np.array([joint.torque_rms for joint in joints])
    share = (errors * np.sqrt(excited) / np.maximum(torque, np.finfo(float).tiny)[:, None]).max(axis=0)
    known = (errors <= DETERMINED_ERROR * np.abs(values)) | (share <= NEGLIGIBLE_TORQUE)
    own = np.array([column.term != "rigid_body" for column in columns])
    lost = np.array([not joints[column.joint - 1].identified for column in columns])
    return known & (excited.sum(axis=0) > 0) & ~(own & lost)
