"""The page with the robot in 3-D, as text and in a real browser."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from oed.reports import Finding, animate, motion_page, render
from oed.reports.rendering.page import Section
from oed.reports.rendering.picture import Panel, Picture, Series
from robots.limits import Margin
from tests.oed.reports.animations.test_building import motion, robot

NEAR = Margin(quantity="velocity", joint=2, value=1.8, limit=2.0, time=1.5, slack_fraction=0.1)


# How many colours the canvas has.
COLOURS = """(() => {
  const canvas = document.querySelector("canvas"), seen = new Set();
  const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
  for (let i = 0; i < data.length; i += 4) if (data[i + 3]) seen.add(data.slice(i, i + 3).join());
  return seen.size;
})()"""


def test_page_stands_alone() -> None:
    """One file below 0.2 MB with the verdict, the joints, the closest approaches, and words without scripts."""
    text = render(motion_page(animate(robot(), motion())))
    assert len(text) < 200_000
    assert "plotly" not in text.split("<style>")[0]
    assert "keeps the robot&#39;s limits" in text
    assert "The robot in 3-D needs JavaScript. What it shows: two, drawn with" in text
    assert text.count("<tr data-joint=") == 2


def test_verdicts() -> None:
    """Limits that are exceeded ask for action, findings of a diagnosis are listed, no limits are said so."""
    kept = animate(robot(), motion())
    beyond = replace(kept, approaches=(replace(NEAR, value=2.2, slack_fraction=-0.1),))
    page = motion_page(beyond)
    assert page.level == "act"
    assert "velocity of joint 2 at 1.500 s" in page.verdict
    # A robot that has made a motion can make it.
    assert motion_page(replace(beyond, source="log")).level == "note"
    assert motion_page(replace(kept, approaches=())).verdict.startswith("The robot's description states no limits")
    found = motion_page(kept, findings=[Finding(code="effect.design", text="A spring.")])
    assert "the diagnosis has 1 finding." in found.verdict
    assert found.level == "note"


INSTANT = (
    "(() => { const line = document.querySelector('.instant'); return line && !line.hidden && line.offsetLeft; })()"
)


@pytest.mark.slow
def test_plots_and_robot_share_one_instant(browser, tmp_path: Path) -> None:
    """The line in a plot over time follows the robot, and the robot the plot that is pointed at."""
    animation = animate(robot(), motion())
    panel = Panel(x_label="time [s]", series=(Series(x=animation.t, y=animation.q[:, 0]),))
    section = Section(title="Over time", pictures=(Picture(title="q", name="q", panels=(panel,)),))
    page = motion_page(animation)
    path = tmp_path / "page.html"
    path.write_text(render(replace(page, sections=(*page.sections, section))))
    browser.open(path, width=1000)
    wait = "new Promise((resolve) => setTimeout(resolve, 300))"
    browser.run("document.querySelector('.plot').scrollIntoView()")
    browser.run(wait)
    browser.run("document.querySelector('.animation').focus()")
    browser.press("End", 35)
    browser.run(wait)
    last = browser.run(INSTANT)
    browser.press("Home", 36)
    browser.run(wait)
    assert browser.run(INSTANT) < last
    browser.run("document.dispatchEvent(new CustomEvent('oed-pointed', { detail: 1.0 }))")
    browser.run(wait)
    assert browser.run("document.querySelector('.clock').textContent").startswith("1.00")
    assert not browser.problems


def test_a_motion_with_a_collision_is_not_to_be_played() -> None:
    """The frames in which bodies meet come with their links; words, verdict and badge say it, but not of a log."""
    free = animate(robot(), motion())
    assert "Collision" not in free.summary()
    hit = replace(free, meetings={3: (-1, 2)})
    words = f"the surroundings and link 2 meet at {hit.t[3]:.2f} s"
    assert f"Collision: {words}." in hit.summary()
    assert '"meetings":{"3":[-1,2]}' in hit.to_json()
    page = motion_page(hit)
    assert (page.level, page.verdict) == ("act", f"Do not play the motion: {words}.")
    assert motion_page(replace(hit, source="log")).level == "good"


@pytest.mark.slow
def test_in_browser(in_browser, browser, tmp_path: Path) -> None:
    """Drawn at all sizes; the script's flange is ours; keys play and step; limits light up and joints are marked."""
    animation = animate(robot(velocity=np.array([2.0, 1.85])), motion(), marks={2: "spring"})
    page = motion_page(animation)
    in_browser(page)
    path = tmp_path / "page.html"
    path.write_text(render(page))
    browser.open(path, width=1000)
    frame = 40
    for _ in range(frame):
        browser.press("ArrowRight", 39)
    pause = "new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)))"
    browser.run(pause)
    shown = [float(word) for word in browser.run("document.querySelector('.flange').textContent").split(",")]
    # Steps of 40 ms are the frames' own; positions are rounded to 1e-4 rad, the text to 1 mm.
    np.testing.assert_allclose(shown, animation.path[frame], atol=1e-3)
    assert browser.run(COLOURS) > 50
    assert browser.run("document.querySelector('tr[data-joint=\"2\"] .badge').textContent") == "spring"
    # At the start joint 2 moves at 1.8 of 1.85 rad/s.
    browser.press("Home", 36)
    browser.run(pause)
    light = 'document.querySelector(\'tr[data-joint="{}"] td[data-quantity="velocity"]\').className'
    assert [browser.run(light.format(joint)) for joint in (1, 2)] == ["", "near"]
    browser.press(" ", 32)
    assert browser.run("document.querySelector('.play').textContent") == "Pause"
    browser.run("new Promise((resolve) => setTimeout(resolve, 400))")
    browser.press(" ", 32)
    assert browser.run("document.querySelector('.play').textContent") == "Play"
    assert 0.1 < float(browser.run("document.querySelector('.time').value")) < 2.0
    assert browser.problems == []
