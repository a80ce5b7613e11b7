"""Models drawn about one truth, with known covariances: no logs are needed to test comparisons."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from estimation.models.model import Model
from robots.base_parameters import BaseParameters, find_base_parameters
from robots.regressor import default_model
from robots.robot import Robot

ARM_SPEED = [2.0, 3.0, 2.5]


@pytest.fixture(scope="session")
def base(upright: Robot) -> BaseParameters:
    """Base parameters of a robot of three joints."""
    return find_base_parameters(default_model(upright, friction="coulomb-viscous", velocity_scale=1e-3))


@pytest.fixture(scope="session")
def truth(base: BaseParameters) -> np.ndarray:
    """The robot's true base parameters."""
    return base.from_standard(np.nan_to_num(base.model.nominal))


@pytest.fixture(scope="session")
def covariance(base: BaseParameters, truth: np.ndarray) -> np.ndarray:
    """A full covariance: errors of about 1 %, all correlated."""
    rng = np.random.default_rng(0)
    mixing = rng.normal(size=(base.size, base.size + 5)) / np.sqrt(base.size + 5)
    scale = 0.01 * np.maximum(np.abs(truth), 0.05)
    return scale[:, None] * (mixing @ mixing.T) * scale


@pytest.fixture(scope="session")
def draw(base: BaseParameters, truth: np.ndarray, covariance: np.ndarray) -> Callable[..., Model]:
    """Draw an estimate of the robot, its friction multiplied joint by joint where asked."""
    root = np.linalg.cholesky(covariance)

    def build(seed: int, friction: tuple[float, ...] = (1.0, 1.0, 1.0), **provenance: object) -> Model:
        values = truth.copy()
        for i, column in enumerate(base.columns):
            if column.friction:
                values[i] *= friction[column.joint - 1]
        values = values + root @ np.random.default_rng(seed).normal(size=base.size)
        known = {
            "recorded": {"position": [[-1.0] * 3, [1.0] * 3], "velocity": [ARM_SPEED], "acceleration": [[9.0] * 3]},
            "prior_share": [0.0] * base.size,
        }
        return Model(
            torque_model=base.model,
            columns=base.independent,
            values=values,
            covariance=covariance,
            determined=np.ones(base.size, dtype=bool),
            formulas=base.formulas(),
            provenance=known | provenance,
        )

    return build
