"""What is said of a motion's collisions, in every place where someone may take it for playable."""

from __future__ import annotations

import json

import numpy as np
import pytest

import oed
from oed.experiments import LimitOptions, SearchOptions, TrajectoryOptions
from oed.experiments.safety_checks.freedom import UNCHECKED, collides, collision_data, freedom_text, is_free
from oed.exports import export_trajectory, read_trajectory
from oed.exports.trajectory_checks import stated_collisions
from oed.reports.pages.design_report import design_page
from robots.collision import Box, Scene, Surroundings, check_motion, collision_model
from robots.loading import load_robot
from robots.signals import Motion

QUICK = {"search": SearchOptions(effort="quick"), "trajectory": TrajectoryOptions(periods=1, strokes=False)}


@pytest.fixture(scope="module")
def er3a():
    return load_robot("er3a")


def still(q, seconds=0.1):
    """A robot that stands."""
    t = np.linspace(0.0, seconds, 26)
    zero = np.zeros((26, len(q)))
    return Motion(t, np.tile(q, (26, 1)), zero, zero)


def test_each_state_has_one_sentence(er3a):
    """Not checked, free, and colliding motions have a sentence each, and only the second is free."""
    post = np.eye(4)
    post[:3, 3] = er3a.chain.flange(np.zeros(6))[:3, 3]
    blocked = collision_model(er3a, scene=Scene(obstacles=(Box(name="post", size=[0.1, 0.1, 0.1], pose=post),)))
    model, motion = collision_model(er3a), still(np.zeros(6))
    free = collision_data(model, check_motion(model, motion, confirm=False))
    hit = collision_data(blocked, check_motion(blocked, motion, confirm=False))
    assert freedom_text(None) == f"{UNCHECKED}: neither with the robot itself nor with the floor."
    assert freedom_text(free).startswith("No collision with itself, floor at z = 0 m; closest: ")
    assert "The shapes of the links are assumed." in freedom_text(free)
    assert freedom_text(hit).startswith("COLLIDES: post / ")
    unproved = {**free, "certified": False}
    assert freedom_text(unproved).startswith("NOT PROVED free of collisions with itself, floor at z = 0 m; closest: ")
    for freedom, proved in ((None, False), (free, True), (hit, False), (unproved, False)):
        assert stated_collisions({"collisions": freedom_text(freedom)})[1] == proved
    assert [is_free(f) for f in (None, free, hit)] == [False, True, False]
    assert [collides(f) for f in (None, free, hit)] == [False, False, True]
    json.dumps([free, hit], allow_nan=False)


@pytest.mark.slow
def test_a_design_keeps_clear_of_the_floor_by_default(er3a, tmp_path):
    """Nothing of a default design is below the floor; the file, the report and each export say what was checked."""
    made = oed.design(er3a, **QUICK)
    model = collision_model(er3a)
    assert check_motion(model, made.motion, confirm=False).certified
    lowest = min(
        float((pose[:3, :3] @ end + pose[:3, 3])[2]) - capsule.radius
        for poses in er3a.chain.transforms(made.motion.q[::20])
        for capsule in model.capsules
        if capsule.link
        for pose in (poses[capsule.link - 1],)
        for end in (capsule.start, capsule.end)
    )
    assert lowest > 0.005  # 10 mm are kept at the solver's samples
    assert "No collision with itself, floor at z = 0 m" in made.summary()
    assert design_page(made).verdict.startswith("Play ")
    made.save(tmp_path)
    motion, metadata = read_trajectory(tmp_path / "trajectory.csv")
    assert metadata["collisions"] == freedom_text(made.freedom)
    for form, suffix, begin in (("urscript", ".script", "#"), ("kuka", ".dat", ";"), ("abb", ".mod", "!")):
        export_trajectory(tmp_path / f"out{suffix}", motion, er3a, form, metadata=metadata)
        assert f"\n{begin} No collision with itself" in (tmp_path / f"out{suffix}").read_text()


@pytest.mark.slow
def test_a_design_without_the_check_says_so_everywhere(er3a, tmp_path):
    """A design that was not checked is marked in headline, design.json, trajectory, report and exports."""
    made = oed.design(er3a, limits=LimitOptions(collision=False), **QUICK)
    assert UNCHECKED in made.summary()
    page = design_page(made)
    assert page.verdict == f"Do not play this motion. {freedom_text(None)}"
    assert "collision.unchecked" in {finding.code for finding in page.findings}
    made.save(tmp_path)
    assert json.loads((tmp_path / "design.json").read_text())["collision"] is None
    motion, metadata = read_trajectory(tmp_path / "trajectory.csv")
    assert metadata["collisions"].startswith(UNCHECKED)
    export_trajectory(tmp_path / "out.script", motion, er3a, "urscript", metadata=metadata)
    assert f"\n# {UNCHECKED}" in (tmp_path / "out.script").read_text()
    export_trajectory(tmp_path / "foreign.script", motion, er3a, "urscript", metadata={})
    assert f"\n# {UNCHECKED}, as far as its file says." in (tmp_path / "foreign.script").read_text()


@pytest.mark.slow
@pytest.mark.longer
def test_a_box_to_keep_out_of_is_kept_out_of(er3a):
    """A box in the arm's reach is never entered, and the sentence names it."""
    pose = np.eye(4)
    pose[:3, 3] = [0.0, 0.55, 0.3]
    shelf = Box(name="shelf", size=[0.4, 0.2, 0.3], pose=pose)
    made = oed.design(er3a, limits=LimitOptions(surroundings=Surroundings(keep_out=(shelf,))), **QUICK)
    assert check_motion(collision_model(er3a, scene=Scene(obstacles=(shelf,))), made.motion, confirm=False).certified
    assert ", shelf" in freedom_text(made.freedom)
