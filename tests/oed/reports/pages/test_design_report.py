"""The page of a design: the numbers of the result, what a reader must know, and nothing from outside."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from oed.experiments import Design, Effort, Ipopt
from oed.reports import design_page, render, save_design_report, significant
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
    assert f"over {design.base.size} parameters" in html
    for name in design.base.names:
        assert f"{name}<" in html
    assert "sinusoid" in html
    assert "finished" in html
    assert "A robot of &lt;two&gt; joints" in html


def test_warns(html: str) -> None:
    """Assumed values, and what was not checked, are said."""
    assert "limits.torque" in html
    assert "Collisions were not checked." in html
    assert "Torque limits were not checked" in html  # for the robot's dynamics are not described


def test_warns_of_assumed_limits() -> None:
    """Acceleration and jerk limits that the description lacks are named by joint, with what was taken instead."""
    design = design_for(robot(acceleration=np.array([10.0, np.inf]), jerk=np.array([np.inf, np.inf])))
    warnings = " ".join(design_page(design).warnings)
    assert "acceleration limit for joint 2;" in warnings
    assert "jerk limit for joint 1, 2;" in warnings


def test_a_passed_limit_is_bad_news(design: Design) -> None:
    """A margin below zero turns the verdict, and names quantity, joint and time."""
    fast = next(margin for margin in design.margins if (margin.quantity, margin.joint) == ("velocity", 2))
    worst = replace(fast, slack_fraction=-0.5, value=9.0)
    page = design_page(replace(design, margins=(worst, *design.margins)))
    assert page.status == "bad"
    assert f"exceeds a limit: velocity of joint 2 at {fast.time:.3f} s" in page.verdict
    assert design_page(design).status == "good"


def test_pictures_on_request(design: Design, tmp_path: Path) -> None:
    """With PNG each picture is a file; without, the page is alone."""
    with ResultFolder(tmp_path / "plain") as folder:
        save_design_report(design, folder)
    with ResultFolder(tmp_path / "pictures") as folder:
        save_design_report(design, folder, png=True)
    assert [path.name for path in (tmp_path / "plain").iterdir()] == ["report.html"]
    pictures = sorted((tmp_path / "pictures").glob("*.png"))
    assert [p.stem for p in pictures] == sorted(picture.name for picture in design_page(design).pictures)
    assert all(p.read_bytes().startswith(b"\x89PNG") for p in pictures)
