"""Specification of the names that are kept: forms that no machine has, and rivals that leave a name open."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.diagnosis.calibration import CLOSE_RIVAL_BIC, RARE_ODDS
from estimation.diagnosis.hypothesis_tests.fitted_effects import FittedEffect
from estimation.diagnosis.hypothesis_tests.hypotheses import Hypothesis
from estimation.diagnosis.searches.selection import SelectedEffect
from estimation.diagnosis.validations import name_comparison
from robots.robot import Robot
from robots.terms.effects import EFFECTS
from robots.terms.effects.time_delay import near
from tests.estimation.diagnosis.comparison_bench import ROWS, accepting, member_of


@pytest.mark.parametrize(
    ("name", "value", "believed"),
    [
        ("encoder_offset", 0.5, False),
        ("encoder_offset", -0.495, False),
        ("encoder_offset", -0.02, True),
        ("current_clipping", 1.0, True),
    ],
)
def test_a_value_at_the_edge_of_what_machines_have_is_no_name(
    name: str, value: float, believed: bool, arm: Robot
) -> None:
    """An encoder half a radian off wants to be more than that; all of a torque may be cut off; teeth have some play."""
    problem = SimpleNamespace(situation=SimpleNamespace(robot=arm))
    member = replace(member_of(name, 1, 300.0, 1), coefficients=np.array([value]))
    assert name_comparison._is_plausible(problem, member) is believed  # type: ignore[arg-type]
    for seconds in (5.0, 20.0):
        hot = replace(member_of("torque_constant_heat", 1, 300.0, 1), coefficients=np.array([-0.1]), shape=(seconds,))
        assert name_comparison._is_plausible(problem, hot) is (seconds > 5.0)  # type: ignore[arg-type]
    assert EFFECTS["backlash"].is_plausible(arm, 1, np.full(1, 1e-6))
    assert not EFFECTS["backlash"].is_plausible(arm, 1, np.full(1, 1e-7))


@pytest.mark.parametrize(
    ("worth", "believed", "kept"),
    [
        (90.0, True, True),  # with reversals as late as all else it explains nearly as much: a machine may have that
        (60.0, True, False),  # without its torn reversals it is another effect
        (90.0, False, False),  # that form is no machine's either
    ],
)
def test_a_form_that_no_machine_has_may_give_way_to_a_likely_one(
    worth: float, believed: bool, kept: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A delay of a gain of 100 stands at the end of the range that its reversals allow it."""
    torn = replace(member_of("time_delay", None, 100.0, 0), shape=(0.004,), coefficients=np.array([near(0.004)[0][1]]))

    def refined(
        problem: object, hypothesis: Hypothesis, shape: tuple[float, ...], beside: object, *, effort: int
    ) -> FittedEffect:
        assert effort == 0
        return replace(
            torn, shape=shape, gain=worth, coefficients=np.array([shape[0] if believed else near(shape[0])[0][1]])
        )

    accepting(monkeypatch, lambda problem, groups: SimpleNamespace(gain=0.0))
    monkeypatch.setattr(name_comparison, "refine", refined)
    problem: Any = SimpleNamespace(rows=ROWS, state_for=lambda effect: None, situation=SimpleNamespace(robot=None))
    given = name_comparison._plausible_form(problem, SelectedEffect(torn, 1e-9, ()), [torn])
    assert (given is not None) is kept
    if given is not None:
        assert given.effect.shape == (near(0.004)[0][1],)


@pytest.mark.parametrize(
    ("rival", "worse", "stays_open"),
    [
        ("spring", CLOSE_RIVAL_BIC - 1.0, True),
        ("spring", CLOSE_RIVAL_BIC + 1.0, False),
        ("load_heat", RARE_ODDS - 1.0, True),  # as rare as it is, the data speak for it as much
        ("load_heat", RARE_ODDS + 1.0, False),
    ],
)
def test_a_rare_rival_leaves_a_name_open_where_the_data_alone_speak_for_it(
    rival: str, worse: float, stays_open: bool
) -> None:
    """Its BIC is that much worse beforehand."""
    other = member_of(rival, 1, 100.0, 2)
    assert (
        name_comparison.has_close_rivals(
            SelectedEffect(member_of("thermal_friction", 1, 110.0, 2), 1e-9, ((other, worse),))
        )
        is stays_open
    )
