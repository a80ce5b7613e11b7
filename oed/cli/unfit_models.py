"""What makes the model of a command's result unfit for simulation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from estimation.models.model import Model
    from estimation.predictions.simulability import UnfitDirection
    from robots.signals import Log

NEAREST = "model_for_simulation.json"


def unfit_of(model: Model, logs: Sequence[Log]) -> UnfitDirection | None:
    """Finds why a model cannot be simulated in the poses of logs.

    Args:
        model: the model.
        logs: where it is simulated.

    Returns:
        None for a model that can be simulated, or without a description that gives a nearest one.
    """
    import numpy as np

    from estimation.predictions.simulability import find_unfit_direction
    from robots.common.errors import InfeasibleError, InputError, SolverError
    from robots.signals import Motion

    motions = [Motion(log.t, log.q, np.zeros_like(log.q), np.zeros_like(log.q)) for log in logs]
    try:
        return find_unfit_direction(model, motions)
    except (InputError, InfeasibleError, SolverError):
        return None
