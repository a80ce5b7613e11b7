"""Whether a model fits a log at all: without that, every sample would be a contact."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimation.external_forces.residuals.signals import Signals
from robots.common.errors import NotIdentifiableError
from robots.terms.friction import SLOWEST

Array = NDArray[np.float64]

# The band is to hold 95 % of a healthy log's errors. Where it holds less than half, something acts most of the time.
HALF = 0.5
# A joint that moves in a smaller share of the samples does not test the model.
FEW = 0.1


def check_fit(signals: Signals, band: Array | None, name: str) -> str | None:
    """Compares a log's torque with the model's prediction of it, with the level of friction as it is followed.

    Only samples count in which a joint moves: friction holds a joint that stands with any torque.

    Args:
        signals: of the log.
        band: half-widths (N, n) of the model's 95 % band [N m or N]; None without one.
        name: of the log, for the message.

    Returns:
        A warning if most errors of some joint are outside the model's band, else None.

    Raises:
        NotIdentifiableError: the error of such a joint varies more than its torque, so that the model is of no use.
    """
    if band is None:
        return None
    outside, ratio = np.zeros((2, signals.torque.shape[1]))
    for j in range(len(outside)):
        moving = np.abs(signals.dq[:, j]) > SLOWEST
        if moving.mean() < FEW:
            continue
        error = signals.direct[moving, j]
        outside[j] = np.mean(np.abs(error) > band[moving, j])
        ratio[j] = np.sqrt(np.mean(error**2)) / max(float(signals.torque[moving, j].std()), np.finfo(float).tiny)
    joint = int(np.argmax(np.where(outside > HALF, ratio, 0.0)))
    if not outside[joint] > HALF:
        return None
    if ratio[joint] > 1.0:
        raise NotIdentifiableError(
            f"the model does not fit this log: the torque error is {100 * ratio[joint]:.0f} % of the torque's standard "
            f"deviation",
            file=name or None,
            joint=joint + 1,
            remedy="the log may be of another robot, the robot may carry a load (--payload), or its torque may have "
            "another meaning (--torque-is); check it with oed predict, or identify the robot again",
        )
    return (
        f"joint {joint + 1}: {100 * outside[joint]:.0f} % of the torque errors are outside the model's 95 % band; the "
        "threshold is higher accordingly: identify the robot again, or state its payload or temperature"
    )
