"""Stages keep clear of the arm's own bodies and of obstacles; coal is the oracle."""

from __future__ import annotations

import dataclasses
from itertools import pairwise

import numpy as np
import pytest

import oed
from oed.campaigns import Campaign, Programme
from oed.campaigns.checking import TorqueCheck
from oed.campaigns.clearances import CollisionFreeRanges
from oed.campaigns.planning import Planner
from oed.experiments import Design
from oed.experiments.safety_checks.freedom import is_free
from oed.trajectories import Segment
from robots.collision import Box, CoalChecker, Scene, check_motion, collision_model
from robots.loading import load_robot
from robots.robot import Robot

SPARSE = 25


@pytest.mark.slow
@pytest.mark.parametrize("name", ["er3a", "ur10", pytest.param("panda", marks=pytest.mark.longer)])
def test_no_pose_of_a_trimmed_box_collides(name: str) -> None:
    """No pose of the box collides by coal's own distances, home is in it, and most of the wanted room is left.

    A box of which a share of 1 in 1000 collided would pass 20,000 random poses with a chance of 2e-9.
    """
    robot = load_robot(name)
    # At home the wrist of the ur10 reaches below its mounting plane.
    model, home = collision_model(robot, floor=False), robot.limits.home
    box = CollisionFreeRanges(model, home).box(robot.limits, 0.8)
    assert ((box.lower <= home) & (home <= box.upper)).all()
    q = np.random.default_rng(1).uniform(box.lower, box.upper, (20_000, robot.n))
    assert model.clearance(q).min() > 0.0
    assert CoalChecker(model).clearance(q[:: SPARSE * 4]).min() > 0.0
    share = (box.upper - box.lower) / (0.8 * (robot.limits.upper - robot.limits.lower))
    assert np.prod(share) > 0.25


def test_a_box_of_a_free_arm_is_not_trimmed() -> None:
    """Where nothing collides, the whole wanted range is used."""
    robot = load_robot("er3a")
    alone = dataclasses.replace(collision_model(robot, floor=False), capsules=collision_model(robot).capsules[-1:])
    box = CollisionFreeRanges(alone, robot.limits.home).box(robot.limits, 0.8)
    assert box.upper - box.lower == pytest.approx(0.8 * (robot.limits.upper - robot.limits.lower))


def test_a_stretch_ends_where_the_next_step_collides() -> None:
    """A joint's stretch is free of collisions, and one grid step beyond its ends is not, or is the end of the range."""
    robot = load_robot("er3a")
    model, limits = collision_model(robot), robot.limits
    low, high = CollisionFreeRanges(model, limits.home, clearance=1e-6).stretch(limits, 3, limits.home)
    step = (limits.upper[2] - limits.lower[2]) / 180.0
    inside = np.tile(limits.home, (200, 1))
    inside[:, 2] = np.linspace(low, high, 200)
    assert CoalChecker(model).clearance(inside).min() > 0.0
    beyond = limits.home.copy()
    beyond[2] = low - step
    assert CoalChecker(model).clearance(beyond[None]).min() < 1e-3
    assert high == pytest.approx(limits.upper[2])


def test_ways_lead_from_pose_to_pose() -> None:
    """Every way starts and ends where it must, and the roundabout ones move one joint at a time or pass home."""
    robot = load_robot("er3a")
    home, rng = robot.limits.home, np.random.default_rng(2)
    start, end = rng.uniform(-1.0, 1.0, (2, robot.n))
    ways = list(CollisionFreeRanges(collision_model(robot), home).ways(start, end))
    assert len(ways) == 6
    for poses in ways:
        np.testing.assert_array_equal(poses[0], start)
        np.testing.assert_array_equal(poses[-1], end)
    for poses in ways[2:]:
        assert all(np.count_nonzero(a != b) == 1 for a, b in pairwise(poses))


@pytest.mark.slow
def test_planned_stages_are_proved_free(thesis_campaign: Campaign) -> None:
    """Friction sweeps, warm-up and moves of the er3a meet nothing at any time; the note shows what that cost."""
    model = collision_model(thesis_campaign.robot)
    for stage in thesis_campaign.stages:
        if stage.kind != "excitation":
            assert check_motion(model, stage.motion, confirm=False).certified, stage.name
            assert is_free(stage.freedom), stage.name
            assert CoalChecker(model).clearance(stage.motion.q[::SPARSE]).min() > 0.0
    assert any("To avoid collisions" in note for note in thesis_campaign.notes)


@pytest.mark.slow
def test_without_clearing_the_warm_up_drives_what_was_asked_and_says_that_it_collides(
    er3a: Robot, er3a_design: Design
) -> None:
    """With collisions allowed the er3a's warm-up over 80 % of its ranges touches, and the first note says where."""
    free = oed.campaign(er3a, design=er3a_design, programme=Programme(cycles=1), collision=False)
    assert any(note.startswith("COLLISION in the warm_up") for note in free.notes)
    warm_up = next(stage for stage in free.stages if stage.kind == "warm_up")
    assert np.ptp(warm_up.motion.q, axis=0) == pytest.approx(0.8 * (er3a.limits.upper - er3a.limits.lower), rel=1e-3)


def test_moves_go_around_an_obstacle(er3a: Robot) -> None:
    """A post beside the arm is in the straight way between two poses; the planner folds the arm and is proved free."""
    turn = np.eye(4)
    turn[:3, 3] = 0.3 * np.cos(0.75), 0.3 * np.sin(0.75), 0.6
    post = Box(name="post", size=np.array([0.06, 0.06, 1.2]), pose=turn)
    model = dataclasses.replace(collision_model(er3a), scene=Scene(obstacles=(post,)))
    home, start, end = np.zeros((3, 6))
    home[2], start[0], end[0] = 1.4, 0.0, 1.5
    planner = Planner(
        robot=er3a,
        limits=er3a.limits,
        home=home,
        torque=TorqueCheck(er3a, 0.1),
        free_ranges=CollisionFreeRanges(model, home),
    )

    def least(segments: list[Segment]) -> float:
        motions = [segment.trajectory.motion(er3a.period) for segment in segments]
        return min(float(CoalChecker(model).clearance(motion.q).min()) for motion in motions)

    assert least(planner.stops(er3a.limits, (start, end))) < 0.0
    around = planner.move(er3a.limits, start, end)
    assert least(around) > 0.0
    np.testing.assert_allclose(around[-1].trajectory.sample([np.inf]).q[0], end, atol=1e-9)
