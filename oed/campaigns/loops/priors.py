"""The prior information that an identified model gives a design."""

from __future__ import annotations

import numpy as np

from estimation import Model
from oed.criteria import Prior
from robots.plants import PlantEffect


def prior_from(model: Model) -> tuple[Prior, tuple[PlantEffect, ...]]:
    """Gives a design what a model knows: its information matrix, and its extensions.

    Args:
        model: identified before.
    """
    return _prior(model), tuple(
        PlantEffect(
            effect=extension.effect,
            joint=extension.joint,
            coefficients=tuple(float(c) for c in extension.coefficients),
            shape=tuple(extension.shape),
        )
        for extension in model.extensions
    )


def _prior(model: Model) -> Prior:
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
