"""The page of an identification: every parameter with its error, and how well torque is predicted."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from estimation import identify
from estimation.identifications.estimate import Estimate
from oed.reports import Page, estimate_page, render, save_report, significant, significant_error
from robots.common.files import ResultFolder
from robots.geometry.chain import Chain, Joint
from robots.limits import Limits
from robots.plants import nominal_plant, simulate
from robots.robot import Robot
from robots.signals import Motion

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def estimate() -> Estimate:
    upright = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    joints = (
        Joint("lift", "revolute", np.eye(3), np.array([0, 0, 0.3]), np.array([0, 0, 1.0])),
        Joint("swing", "revolute", upright, np.array([0.1, 0, 0]), np.array([0, 0, 1.0])),
    )
    two = np.ones(2)
    robot = Robot(
        name="two",
        chain=Chain(joints),
        limits=Limits(-2 * two, 2 * two, 9 * two, 99 * two, 999 * two, 300 * two),
        inertia=np.array([[5, 0.1, 0, 0.5, 0.2, 0, 0, 0.2, 0, 0.1], [3, 0.6, 0.03, 0, 0.02, 0, 0, 0.2, 0, 0.2]]),
        friction=np.array([[4.0, 3, 0, 0], [3, 2, 0, 0]]),
    )
    t = 0.004 * np.arange(8000)
    w, amplitude = 2 * np.pi * np.array([[0.1, 0.17], [0.43, 0.29]]), np.array([[0.9, 0.8], [0.3, 0.4]])
    phase = t[:, None, None] * w
    parts = [np.sin(phase), w * np.cos(phase), -(w**2) * np.sin(phase)]
    log = simulate(nominal_plant(robot), Motion(t, *((amplitude * part).sum(axis=1) for part in parts)))
    return identify(robot, [log])


@pytest.fixture(scope="module")
def html(estimate: Estimate) -> str:
    return render(estimate_page(estimate))


def test_tells_every_parameter(estimate: Estimate, html: str) -> None:
    """Each parameter has its value, its standard error and its unit on the page; an undetermined one says so."""
    model = estimate.model
    table = html[html.index("Values are rounded to two digits") :].partition("</table>")[0]
    rows = {
        cells[0]: cells
        for cells in (
            re.findall(r"<td[^>]*>\s*(.*?)\s*</td>", row, re.S) for row in re.findall(r"<tr>.*?</tr>", table, re.S)
        )
        if cells
    }
    for name, value, error, known in zip(
        model.names, model.values, model.standard_errors, model.determined, strict=True
    ):
        if known:
            assert rows[name][1:3] == [significant(value, error), significant_error(error)]
        else:
            assert rows[name][1] == "not determined"


def test_tells_the_errors(estimate: Estimate, html: str) -> None:
    """The key figures count the parameters; each joint's errors, fitted and left out, are in the table."""
    page = estimate_page(estimate)
    assert f"{int(estimate.model.determined.sum())} of {len(estimate.model.names)}" == page.facts[0].value
    for joint in estimate.joints:
        assert significant(100 * joint.residual_rms / joint.torque_rms) in html
        assert significant(100 * joint.held_out_rms / joint.torque_rms) in html


def test_shows_its_warnings(estimate: Estimate, html: str) -> None:
    """Whatever the estimate warns of, the page does."""
    texts = [finding.text for finding in estimate_page(estimate).findings]
    assert set(estimate.warnings) <= set(texts)
    for warning in estimate.warnings:
        assert warning.split("'")[0][:40] in html


def test_stands_alone(html: str) -> None:
    """The page loads nothing from anywhere."""
    assert not re.search(r"<(?:script|img|iframe)[^>]*\ssrc=", html)
    assert "http://" not in html
    assert "https://" not in html


def test_pictures_on_request(estimate: Estimate, tmp_path: Path) -> None:
    """With PNG each picture is a file beside the page."""
    with ResultFolder(tmp_path / "out") as folder:
        save_report(estimate, folder, png=True)
    names = {path.stem for path in (tmp_path / "out").glob("*.png")}
    assert names == {picture.name for picture in estimate_page(estimate).pictures}


def test_works_in_a_browser(estimate: Estimate, in_browser: Callable[[Page], None]) -> None:
    """The page passes all checks of `browser_checks`."""
    in_browser(estimate_page(estimate))
