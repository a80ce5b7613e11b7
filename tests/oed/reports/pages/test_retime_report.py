"""The page of a retimed path: before and after, from the result itself."""

from __future__ import annotations

import re
from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest

import oed
from oed.experiments import RetimedExperiment
from oed.reports import Page, render, retime_page
from robots.loading import load_robot
from robots.signals import Motion


@pytest.fixture(scope="module")
def case() -> SimpleNamespace:
    robot = load_robot("er3a")
    t = robot.period * np.arange(1501)
    phase = 2 * np.pi * t / t[-1]
    shape = np.array([0.5, 0.4, -0.3, 0.6, 0.5, -0.7])
    w = 2 * np.pi / t[-1]
    given = Motion(
        t,
        (1 - np.cos(phase))[:, None] * shape,
        (w * np.sin(phase))[:, None] * shape,
        (w**2 * np.cos(phase))[:, None] * shape,
    )
    result: RetimedExperiment = oed.retime(robot, given, method="toppra")
    return SimpleNamespace(result=result, given=given, page=retime_page(result, given))


@pytest.mark.slow
def test_tells_before_and_after(case: SimpleNamespace) -> None:
    """The verdict has both durations, and the page both motions."""
    retimed = case.result.retimed
    assert f"{retimed.duration_after:.1f} s instead of {retimed.duration_before:.1f} s" in case.page.verdict
    assert {"after", "before"} <= {picture.name for picture in case.page.pictures}


def test_warns_of_assumed_values(case: SimpleNamespace) -> None:
    """What no source backs is said."""
    assert any("limits.jerk" in finding.text for finding in case.page.findings)


@pytest.mark.slow
def test_stands_alone(case: SimpleNamespace) -> None:
    """The page loads nothing from anywhere."""
    html = render(case.page)
    assert not re.search(r"<(?:script|img|iframe)[^>]*\ssrc=", html)
    assert "http://" not in html
    assert "https://" not in html


@pytest.mark.slow
def test_works_in_a_browser(case: SimpleNamespace, in_browser: Callable[[Page], None]) -> None:
    """The page passes all checks of `browser_checks`."""
    in_browser(case.page)
