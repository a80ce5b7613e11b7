"""The page of a comparison: a change of one joint is never good news, and every run is shown."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimation.comparisons import compare
from estimation.models.model import Model
from oed.reports import Page, comparison_page, render
from oed.reports.pages.comparisons.comparison_report import parts_picture
from robots import load_robot
from robots.base_parameters import find_base_parameters
from robots.regressor import default_model
from tests.oed.reports.said_once import said_twice

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def model() -> Model:
    """A model of the er3a with errors of 1 %."""
    base = find_base_parameters(default_model(load_robot("er3a"), friction="coulomb-viscous", velocity_scale=1e-3))
    values = base.from_standard(np.nan_to_num(base.model.nominal))
    recorded = {"position": [[-1.0] * 6, [1.0] * 6], "velocity": [[2.0] * 6], "acceleration": [[9.0] * 6]}
    return Model(
        torque_model=base.model,
        columns=base.independent,
        values=values,
        covariance=np.diag((0.01 * np.maximum(np.abs(values), 0.01)) ** 2),
        determined=np.ones(base.size, dtype=bool),
        formulas=base.formulas(),
        provenance={"recorded": recorded, "prior_share": [0.0] * base.size},
    )


def runs_of(model: Model, count: int, damage: float) -> list[Model]:
    """Copies with noise; the friction of joint 2 of the last one is multiplied."""
    rng, errors, found = np.random.default_rng(3), np.sqrt(np.diag(model.covariance)), []
    for number in range(count):
        values = model.values.copy()
        if number == count - 1:
            values[[i for i, c in enumerate(model.parameters) if c.friction and c.joint == 2]] *= damage
        found.append(replace(model, values=values + errors * rng.normal(size=len(values))))
    return found


def test_agreeing_runs_are_good_news(model):
    """Without a difference the page is green, and shows the runs over their number."""
    page = comparison_page(compare(runs_of(model, 5, 1.0)))
    assert page.level == "good"
    assert [picture.name for picture in page.pictures] == [
        "tests",
        "friction_runs",
        "friction_difference",
        "friction_course",
        "inertial_course",
    ]
    text = render(page)
    assert all(f"run {number}" in text for number in range(1, 6))
    assert "settled from" in text


def test_all_tests_are_one_chart(model):
    """Each part of each joint has one bar; that of the changed friction is above the line."""
    comparison = compare(runs_of(model, 2, 1.3))
    picture = parts_picture(comparison)
    bars = {series.name: series.y for series in picture.panels[0].series}
    assert int(np.nanargmax(bars["friction"])) == 1
    assert bars["friction"][1] > picture.panels[0].lines[0].value
    parts = {item.name for item in comparison.differences if item.level == "part"}
    assert sum(np.isfinite(values).sum() for values in bars.values()) == len(parts)


def test_damage_is_never_green(model):
    """Friction that changed on one joint alone makes the page red, and its sentence is on it."""
    page = comparison_page(compare(runs_of(model, 2, 1.3)))
    assert page.level == "act"
    assert "Friction changed on joint 2 alone: inspect it." in page.verdict
    texts = [finding.text for finding in page.listed]
    assert any(text.startswith("Joint 2: friction +3") and "inspect this joint" in text for text in texts)
    assert said_twice(page) == []


def test_works_in_a_browser(model: Model, in_browser: Callable[[Page], None]) -> None:
    """The page of a damaged joint passes all checks of `browser_checks`."""
    in_browser(comparison_page(compare(runs_of(model, 2, 1.3))))
