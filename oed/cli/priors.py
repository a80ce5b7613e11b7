"""The prior information that an identified model gives a design."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from estimation import Model, load_model
from oed.criteria import Prior
from robots.common.errors import InputError
from robots.plants import PlantEffect


def prior_from(path: Path, n: int) -> tuple[Prior, tuple[PlantEffect, ...]]:
    """Reads a model file's information matrix and the model extensions.

    Args:
        path: a model.json or its folder.
        n: the number of joints of the robot.

    Raises:
        InputError: no model file, or one of another number of joints.
    """
    model = load_model(path)
    if model.robot.n != n:
        raise InputError(f"a model of {model.robot.n} joints", file=path, allowed=f"{n}")
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
