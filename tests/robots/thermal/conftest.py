"""One model of each kind, of the size of a joint of the er3a."""

from __future__ import annotations

import pytest

from robots.thermal import Advanced, FirstOrder, Fractional, SecondOrder, ThermalModel

MODELS = {
    "first": FirstOrder(alpha=-0.0141, beta=0.9971, K=2.5, C=2200.0),
    "second": SecondOrder(alpha=-0.0141, beta=0.9971, K1=4.41, K2=4.57, C1=737.61, C2=9163.45),
    "fractional": Fractional(alpha=-0.0141, beta=0.9971, K=2.3, C=150.0, nu=0.6121),
    "advanced": Advanced(
        alpha=-0.0141, beta=0.9971, K12=4.41, K2e=4.57, C1=737.61, C2=9163.45, W_e=12.0, K13=1.5, K23=0.8
    ),
}


@pytest.fixture(params=MODELS)
def model(request: pytest.FixtureRequest) -> ThermalModel:
    """Each model in turn."""
    return MODELS[request.param]
