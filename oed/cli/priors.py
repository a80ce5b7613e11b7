"""What an identified model tells a design."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from estimation import load_model
from oed.criteria import Prior


def prior_from(path: Path) -> Prior:
    """Reads the information that a model file carries.

    Raises:
        InputError: no model file.
    """
    model = load_model(path)
    covariance = model.covariance.copy()
    lost = ~model.determined
    covariance[np.diag_indices(len(covariance))] = np.where(lost, np.inf, np.diag(covariance))
    levels = np.array(model.provenance["residual_rms"], dtype=float)
    return Prior(
        names=model.names,
        covariance=covariance,
        noise=np.maximum(levels, 1e-9 * max(float(levels.max()), 1e-9)),
        colour=float(model.provenance.get("colour", 1.0)),
    )
