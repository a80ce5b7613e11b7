"""Terms of a model that a robot description cannot state, and what is lost without them."""

from __future__ import annotations

import numpy as np

from estimation.models.model import Model
from robots.common.plain import two_digits
from robots.terms.position_torque import PositionTorque


def unstated_terms(model: Model, stated: set[str]) -> list[str]:
    """Names the parameters that a file does not hold; of torques by position with their size in the recorded range.

    Args:
        model: the model.
        stated: names of the terms that the file holds, besides friction.
    """
    left = sorted({c.term for c in model.parameters if not c.friction and c.term not in stated})
    return [f"{term.replace('_', ' ')} parameters" + _sizes(model, term) for term in left]


def _sizes(model: Model, term: str) -> str:
    """Says how large the torque by position is: the other parameters were fitted beside it."""
    recorded = model.provenance.get("recorded")
    if term != PositionTorque.name or recorded is None:
        return ""
    low, high = (np.asarray(bound, dtype=float) for bound in recorded["position"])
    q = np.random.default_rng(0).uniform(low, high, (500, model.robot.n))
    values = np.where([column.term == term for column in model.parameters], model.values, 0.0)
    still = np.zeros_like(q)
    largest = np.abs(model.torque_model.torque(q, still, still, values, columns=model.columns)).max(axis=0)
    # A joint is listed from a tenth of the largest torque on.
    sizes = [
        f"{two_digits(size)} {model.robot.limits.unit(joint, 'torque')} at joint {joint + 1}"
        for joint, size in enumerate(largest.tolist())
        if size > 0.1 * float(largest.max())
    ]
    return (
        f" (up to {', '.join(sizes)}; the other parameters were fitted beside them and may err without: identify with "
        "--no-position, or name the cause with oed diagnose)"
    )
