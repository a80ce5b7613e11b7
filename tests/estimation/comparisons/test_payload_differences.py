"""A tool on the flange is named as a payload, with mass and centre, and not as a list of parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimation.comparisons import compare
from estimation.models.model import Model
from robots.base_parameters import BaseParameters, find_base_parameters
from robots.geometry.inertia import inertial_parameters
from robots.loading import load_robot
from robots.regressor import default_model
from robots.terms.situations.flange_body import with_body

MASS, CENTRE = 2.0, (0.03, -0.02, 0.08)
BODY = inertial_parameters(MASS, np.array(CENTRE), np.diag([0.01, 0.012, 0.008]), np.eye(4))


@pytest.fixture(scope="module")
def wrist() -> BaseParameters:
    """Base parameters of an arm of six joints, whose torques show all of a payload."""
    return find_base_parameters(default_model(load_robot("er3a"), friction="coulomb-viscous", velocity_scale=1e-3))


@pytest.fixture(scope="module")
def identified(wrist: BaseParameters) -> Callable[..., Model]:
    """Draw an estimate of the arm with a body on its flange; the errors are 0.5 %."""

    def build(seed: int, body: np.ndarray | None = None, friction: float = 1.0) -> Model:
        nominal = np.nan_to_num(wrist.model.nominal)
        bare = wrist.from_standard(nominal)
        errors = 0.005 * np.maximum(np.abs(bare), 0.05)
        values = wrist.from_standard(with_body(wrist.model, nominal, np.zeros(10) if body is None else body))
        values[[i for i, c in enumerate(wrist.columns) if c.friction and c.joint == 2]] *= friction
        recorded = {"position": [[-1.0] * 6, [1.0] * 6], "velocity": [[2.0] * 6], "acceleration": [[9.0] * 6]}
        return Model(
            torque_model=wrist.model,
            columns=wrist.independent,
            values=values + errors * np.random.default_rng(seed).normal(size=wrist.size),
            covariance=np.diag(errors**2),
            determined=np.ones(wrist.size, dtype=bool),
            formulas=wrist.formulas(),
            provenance={"recorded": recorded, "prior_share": [0.0] * wrist.size},
        )

    return build


@pytest.mark.slow
@pytest.mark.parametrize("removed", [False, True])
def test_a_tool_is_a_payload(identified: Callable[..., Model], removed: bool) -> None:
    """Mass and centre with intervals that hold the truth, whichever run carries it; no parameter differs besides.

    The truth lies within four standard errors, which one seed in 4000 misses of four quantities.
    """
    runs = [identified(1), identified(2, BODY)]
    found = compare(runs[::-1] if removed else runs)
    (payload,) = found.payloads
    assert payload.removed is removed
    for item, truth in zip(payload.found[:4], (MASS, *CENTRE), strict=True):
        assert item.value == pytest.approx(truth, abs=2 * item.half_width)
    assert payload.found[0].half_width < 0.1 * MASS
    assert not found.significant
    carrier = found.labels[0 if removed else 1]
    assert found.verdict().startswith(f"{carrier} carries a payload of ")
    assert "kg on the flange" in found.verdict()
    assert "no difference is significant" in found.verdict()
    assert "parameters that differ" not in found.summary()
    assert "merged model is of neither" in found.summary()
    assert found.to_dict()["payloads"][0]["carried_by"] == carrier


@pytest.mark.slow
def test_what_differs_beside_a_payload(identified: Callable[..., Model]) -> None:
    """Friction that changed as well is named beside the payload."""
    found = compare([identified(1), identified(2, BODY, friction=1.2)])
    assert len(found.payloads) == 1
    assert found.parts(1) == ("friction of joint 2",)


@pytest.mark.slow
def test_what_is_no_payload(identified: Callable[..., Model]) -> None:
    """The same arm carries none; nor does one whose second link alone differs, or whose change no body can have."""
    one, two = identified(1), identified(2)
    assert not compare([one, two]).payloads
    other = two.values.copy()
    other[list(two.names).index(next(n for n in two.names if n.startswith("mPx_2")))] += 3.0
    assert not compare([one, replace(two, values=other)]).payloads
    impossible = BODY.copy()
    impossible[4:] *= -5.0
    assert not compare([one, identified(3, impossible)]).payloads
