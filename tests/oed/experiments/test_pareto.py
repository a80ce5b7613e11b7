"""Designs between the extremes of several criteria."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import oed
from oed.experiments import Design, Effort, ParetoFront
from oed.experiments.pareto_fronts import lattice
from oed.reports import Page
from oed.reports.pages.pareto_report import pareto_page
from robots.common.errors import InputError
from robots.loading import load_robot
from tests.oed.flat import grouped

pytestmark = pytest.mark.slow

BRIEF = Effort(islands=1, starts=1, screened=20, hops=0, finish_samples=100)


@pytest.fixture(scope="module")
def front() -> ParetoFront:
    """Three designs of the er3a from cond to log det."""
    robot = load_robot("er3a")
    return oed.pareto(robot, points=3, **grouped(friction="coulomb-viscous", effort=BRIEF, workers=1, strokes=False))


def test_extremes_are_best_in_their_own_criterion(front: ParetoFront) -> None:
    """The design for cond alone has the smallest cond, that for log det alone the largest log det, and both differ."""
    cond, d = front.values.T
    assert front.weights.tolist() == [[1.0, 0.0], [0.5, 0.5], [0.0, 1.0]]
    assert cond.argmin() == 0
    assert d.argmax() == 2
    assert cond[2] > 2.0 * cond[0]
    assert front.success


def test_values_are_those_of_the_regressor(front: ParetoFront) -> None:
    """Each value is numpy's on the regressor of the design's own Fourier part."""
    for design, (cond, d) in zip(front.designs, front.values, strict=True):
        motion = design.part("fourier")
        Y = design.base.regressor(motion.q, motion.dq, motion.ddq).reshape(-1, design.base.size)
        assert cond == pytest.approx(np.linalg.cond(Y), rel=1e-6)
        assert d == pytest.approx(np.linalg.slogdet(Y.T @ Y)[1], rel=1e-6)


def test_beaten_designs_are_marked(front: ParetoFront) -> None:
    """A design is efficient unless another one is at least as good in all criteria and better in one."""
    values = np.array([[20.0, 500.0], [25.0, 490.0], [30.0, 600.0]])
    made = ParetoFront(criteria=front.criteria, weights=front.weights, designs=front.designs, values=values)
    assert made.efficient.tolist() == [True, False, True]
    assert "dominated" in made.summary().splitlines()[3]
    assert list(made.to_frame()["efficient"]) == [True, False, True]


def test_front_is_saved_with_its_designs(front: ParetoFront, tmp_path: Path) -> None:
    """pareto.json lists the points, and each folder holds a design that loads with its blend."""
    front.save(tmp_path)
    points = json.loads((tmp_path / "pareto.json").read_text())["points"]
    assert [point["folder"] for point in points] == ["point_1", "point_2", "point_3"]
    again = Design.load(tmp_path / "point_2")
    assert again.criterion.name == "0.5*cond+0.5*d"
    assert again.optimised.value("cond") == pytest.approx(front.values[1, 0])


def test_page_says_what_each_extreme_gives_up(front: ParetoFront) -> None:
    """The report states the price, and its picture has a point per design."""
    page = pareto_page(front)
    assert "designing for cond alone" in " ".join(page.sections[0].paragraphs).lower()
    (picture,) = page.pictures
    assert sum(len(series.x) for series in picture.panels[0].series) == 3
    assert front.plot().get_xlabel() == "cond(Y)"


def test_weights_cover_all_mixtures() -> None:
    """Weights are spread evenly over the simplex, corners included: points + k - 2 over k - 1 of them."""
    weights = lattice(3, 4)
    assert weights.shape == (10, 3)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0)
    assert {tuple(row) for row in np.eye(3)} <= {tuple(row) for row in weights}


@pytest.mark.parametrize(
    ("options", "reported"),
    [
        ({"criteria": ("cond",)}, "two or three"),
        ({"criteria": ("cond", "cond")}, "two or three"),
        ({"criteria": ("cond", "d", "a", "e")}, "two or three"),
        ({"criteria": ("cond", "i")}, "use oed design"),
        ({"points": 1}, "at least 2"),
        ({"criteria": ("cond", "beauty")}, "criterion"),
    ],
)
def test_nonsense_is_refused(options: dict, reported: str) -> None:
    """Fewer than two criteria, one twice, one that judges other directions, or one point: refused before any work."""
    with pytest.raises(InputError, match=reported):
        oed.pareto(load_robot("er3a"), **grouped(**options))


@pytest.mark.slow
def test_page_works_in_a_browser(front: ParetoFront, in_browser: Callable[[Page], None]) -> None:
    """The page passes all checks of `browser_checks`."""
    in_browser(pareto_page(front))
