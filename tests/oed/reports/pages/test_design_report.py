"""The page of a design: the numbers of the result, what a reader must know, and nothing from outside."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from oed.experiments import Design, Effort, Ipopt
from oed.experiments.quality import excitation_findings
from oed.reports import Page, design_page, render, save_report, significant
from robots.common.files import ResultFolder
from robots.geometry.chain import Chain, Joint
from robots.limits import Limits
from robots.robot import Robot
from tests.oed import flat

pytestmark = pytest.mark.slow

EFFORT, SOLVER = Effort(islands=1, starts=1, screened=10, hops=0, finish_samples=100), Ipopt(max_iter=10, finish_iter=5)


def robot(**changes) -> Robot:
    upright = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    joints = (
        Joint("lift", "revolute", np.eye(3), np.array([0, 0, 0.3]), np.array([0, 0, 1.0])),
        Joint("swing", "revolute", upright, np.array([0.1, 0, 0]), np.array([0, 0, 1.0])),
    )
    two = np.ones(2)
    limits = {"velocity": 2 * two, "acceleration": 10 * two, "jerk": 200 * two, "torque": 300 * two, **changes}
    return Robot(
        name="two",
        title="A robot of <two> joints",
        chain=Chain(joints),
        limits=Limits(lower=-2 * two, upper=2 * two, **limits),
        assumed=("limits.torque",),
    )


def design_for(described: Robot) -> Design:
    return flat.design(described, effort=EFFORT, solver=SOLVER, periods=1, workers=1)


@pytest.fixture(scope="module")
def design() -> Design:
    return design_for(robot())


@pytest.fixture(scope="module")
def html(design: Design) -> str:
    return render(design_page(design))


def test_stands_alone(html: str) -> None:
    """The page loads nothing: no address, no linked script, style, picture or font."""
    assert not re.findall(r"""(?:src|href)\s*=\s*["'](?!#|data:)""", html.split("<script")[0])
    assert not re.search(r"<(?:script|img|iframe)[^>]*\ssrc=", html)
    assert not re.search(r"<link[^>]*href=[\"'](?!data:)", html)
    assert "http://" not in html
    assert "https://" not in html
    assert "@import" not in html


def test_tells_the_numbers(design: Design, html: str) -> None:
    """Condition numbers, duration, segments, searches and the parameters' meaning are on the page."""
    for quality in (design.optimised, design.whole):
        assert significant(quality.value("cond")) in html
    assert f"{design.motion.duration:.1f} s" in html
    assert f"determines all {design.base.size} base parameters" in html
    for name in design.base.names:
        assert f"{name}<" in html
    assert "sinusoid" in html
    assert "finished" in html
    assert "A robot of &lt;two&gt; joints" in html


def test_warns(html: str) -> None:
    """Assumed values, and what was not checked, are said."""
    assert "limits.torque" in html
    assert "The shapes of the links are assumed." in html
    assert "Torque limits were not checked" in html  # for the robot's dynamics are not described


def test_only_what_was_checked_is_called_playable(design: Design) -> None:
    """Without the check, or with bodies that meet, the verdict forbids playing, and the badge asks for action."""
    hit = {**design.freedom, "clearance": -0.02, "certified": False}
    met = {**design.freedom, "certified": False, "meetings": [["link 1 / link 2", 1.5]]}
    for freedom, code in ((None, "collision.unchecked"), (hit, "collision.found"), (met, "collision.found")):
        page = design_page(replace(design, freedom=freedom))
        assert page.verdict.startswith("Do not play this motion. ")
        assert page.level == "act"
        assert code in {finding.code for finding in page.findings}
    assert design_page(design).verdict.startswith("Play ")


def test_warns_of_assumed_limits() -> None:
    """Acceleration and jerk limits that the description lacks are named by joint, with what was taken instead."""
    design = design_for(robot(acceleration=np.array([10.0, np.inf]), jerk=np.array([np.inf, np.inf])))
    warnings = " ".join(finding.text for finding in design_page(design).findings)
    assert "acceleration limit for joint 2;" in warnings
    assert "jerk limit for joint 1, 2;" in warnings


def test_a_passed_limit_is_bad_news(design: Design) -> None:
    """A margin below zero turns the verdict, and names quantity, joint and time."""
    fast = next(margin for margin in design.margins if (margin.quantity, margin.joint) == ("velocity", 2))
    worst = replace(fast, slack_fraction=-0.5, value=9.0)
    page = design_page(replace(design, margins=(worst, *design.margins)))
    assert page.level == "act"
    assert f"Do not play this motion: it exceeds the limit of velocity of joint 2 at {fast.time:.3f} s" in page.verdict
    assert page.findings[0].code == "limit.exceeded"
    assert design_page(design).level == "note"


@pytest.mark.parametrize(("condition", "code"), [(9e6, "excitation.weak"), (1e12, "excitation.incomplete")])
def test_a_motion_that_leaves_parameters_open_gets_no_tick(design: Design, condition: float, code: str) -> None:
    """A condition number of nine millions, and a regressor without full rank, ask for another design."""
    values = np.geomspace(1.0, condition, design.base.size)
    whole = replace(design.whole, singular_values=tuple(values))
    page = design_page(replace(design, qualities=(*design.qualities[:-1], whole)))
    assert page.level == "act"
    assert code in [finding.code for finding in page.findings]
    assert page.verdict.startswith("Design the experiment again")


def test_the_limit_of_condition_numbers_is_that_of_noise(design: Design) -> None:
    """Noise of 2 % in N samples makes a direction's error 0.02 cond / sqrt(N) of its size: 1 is the limit."""
    limit = np.sqrt(design.whole.samples) / 0.02
    found = [
        excitation_findings(replace(design.whole, singular_values=(1.0, factor * limit))) for factor in (0.99, 1.01)
    ]
    assert [len(findings) for findings in found] == [0, 1]


def test_pictures_on_request(design: Design, tmp_path: Path) -> None:
    """With PNG each picture is a file; without, the page is alone."""
    with ResultFolder(tmp_path / "plain") as folder:
        save_report(design, folder)
    with ResultFolder(tmp_path / "pictures") as folder:
        save_report(design, folder, png=True)
    assert [path.name for path in (tmp_path / "plain").iterdir()] == ["report.html"]
    pictures = sorted((tmp_path / "pictures").glob("*.png"))
    assert [p.stem for p in pictures] == sorted(picture.name for picture in design_page(design).pictures)
    assert all(p.read_bytes().startswith(b"\x89PNG") for p in pictures)


def test_works_in_a_browser(design: Design, in_browser: Callable[[Page], None]) -> None:
    """The page passes all checks of `browser_checks`."""
    in_browser(design_page(design))


def test_the_report_begins_with_home(design: Design) -> None:
    """The first section says where the robot stands at first, and when its first and last moves are, by the file."""
    section = design_page(design).sections[0]
    assert section.title == "Start and end"
    (table,) = section.tables
    home = np.array([row[2] for row in table.rows])
    np.testing.assert_allclose(np.deg2rad(home), design.motion.q[0], atol=1e-9)
    np.testing.assert_allclose(home, np.rad2deg(design.motion.q[-1]), atol=1e-6)
    approach = [s for s in design.segments if s["kind"] == "approach"]
    assert approach
    assert f"ends at {approach[0]['end']:.1f} s" in section.paragraphs[0]
