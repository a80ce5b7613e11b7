import json
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from oed.experiments import RetimedExperiment, retime
from oed.reports.pages.retime_report import retime_page
from oed.retiming import plan_move
from robots import load_robot
from robots.common.errors import InputError
from robots.signals import Motion

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def robot():
    return load_robot("er3a")


@pytest.fixture(scope="module")
def given(robot):
    """Several slow moves through random poses."""
    rng = np.random.default_rng(0)
    slow = robot.limits.scaled(velocity=0.4, acceleration=0.3, jerk=0.3)
    poses = [np.zeros(6), *rng.uniform(-0.8, 0.8, size=(6, 6)), np.zeros(6)]
    motions = []
    for start, end in pairwise(poses):
        plan = plan_move(slow, start, end, period=robot.period)
        t = robot.period * np.arange(round(plan.duration / robot.period) + 1)
        motions.append(Motion(t, *plan.sample(t)))
    return Motion.concatenate(motions, shift=True)


@pytest.fixture(scope="module")
def result(robot, given):
    return retime(robot, given)


@pytest.mark.longer
def test_assumed_limits_are_named(robot, result, given):
    """Limits that the description does not state are in the file, and on the page."""
    free = np.full(robot.n, np.inf)
    stated = replace(robot, assumed=())
    assert replace(result, robot=stated).to_dict()["assumed"] == []
    bare = replace(stated, limits=replace(robot.limits, acceleration=free, jerk=free))
    again = retime(bare, given)
    assert {"limits.acceleration", "limits.jerk"} <= set(again.to_dict()["assumed"])
    codes = [finding.code for finding in retime_page(again, given).findings]
    assert codes.count("limit.assumed") == 2


def test_it_is_faster_within_all_limits(result, robot, given):
    """A slow motion becomes faster, and the margins, measured anew, are positive."""
    assert result.success
    assert result.retimed.duration_after < 0.8 * given.duration
    assert not any(margin.violated for margin in result.check())
    assert {margin.quantity for margin in result.check()} == {
        "lower",
        "upper",
        "velocity",
        "acceleration",
        "jerk",
        "torque",
    }


def test_it_tells_torques_before_and_after(result, given):
    """Peak and RMS are those of the nominal torque along the given and the new samples."""
    model = result.base.model
    for use, motion in ((result.torque_before, given), (result.torque_after, result.motion)):
        tau = model.torque(motion.q, motion.dq, motion.ddq, model.nominal)
        np.testing.assert_allclose(use.peak, np.abs(tau).max(axis=0), rtol=1e-12)
        np.testing.assert_allclose(use.rms, np.sqrt((tau**2).mean(axis=0)), rtol=1e-12)
    # Faster along one path asks more of the motors.
    assert np.all(result.torque_after.rms > result.torque_before.rms)


def test_the_summary_says_what_changed(result):
    """Duration, verdict, criterion and torques, before and after."""
    text = result.summary()
    for words in ("faster", "cond(Y)", "peak torque", "RMS torque", "before", "after"):
        assert words in text


def test_the_file_says_what_changed(result):
    """The data of design.json are JSON without NaN and hold durations, torques, use of limits and the verdict."""
    reported = json.loads(json.dumps(result.to_dict(), allow_nan=False))["retiming"]
    assert reported["duration_after"] < reported["duration_before"]
    assert reported["given_keeps_limits"] is True
    assert reported["verdict"] == result.retimed.verdict()
    for when in ("torque_before", "torque_after"):
        assert len(reported[when]["peak"]) == len(reported[when]["rms"]) == 6
    assert set(reported["usage"]) == set(reported["usage_before"]) == {"velocity", "acceleration", "jerk", "torque"}


def test_it_reads_back_what_it_saved(result, robot, tmp_path):
    """Loaded from its folder it says and holds the same."""
    result.save(tmp_path)
    loaded = RetimedExperiment.load(tmp_path)
    assert loaded.to_dict() == result.to_dict()
    assert loaded.summary() == result.summary()
    np.testing.assert_array_equal(loaded.motion.q, result.motion.q)
    with pytest.raises(InputError, match="not for panda"):
        RetimedExperiment.load(tmp_path, load_robot("panda"))


@pytest.mark.parametrize("content", [None, "{", "[]", "{}"])
def test_a_damaged_file_is_named(tmp_path, content):
    """A missing file, broken JSON and missing entries are input errors that name the file."""
    if content is not None:
        (tmp_path / "design.json").write_text(content)
    with pytest.raises(InputError, match=r"design\.json"):
        RetimedExperiment.load(tmp_path)


def test_it_is_a_table_and_a_picture(result):
    """The table has time, positions, velocities and accelerations; the picture one line a joint."""
    frame = result.to_frame()
    assert list(frame.columns) == ["t", *(f"{name}{joint}" for name in ("q", "dq", "ddq") for joint in range(1, 7))]
    assert len(frame) == len(result.motion)
    axes = result.plot()
    assert len(axes.lines) == 6
    assert max(np.abs(line.get_ydata()).max() for line in axes.lines) <= 1.0
    assert result.plot(axes) is axes


def test_stopping_at_vertices_tells_the_same(robot, given):
    """Retimed by ruckig it stops on the way, and says how it compares."""
    stopped = retime(robot, given, method="ruckig", tolerance=0.05)
    assert stopped.success
    assert stopped.retimed.stops >= 6
    assert stopped.retimed.verdict()


def test_unknown_methods_and_other_robots_are_refused(robot, given):
    """A method that is not there and a motion of other joints are input errors."""
    with pytest.raises(InputError, match="toppra, ruckig"):
        retime(robot, given, method="magic")
    with pytest.raises(InputError, match="a motion of 6 joints"):
        retime(load_robot("panda"), given)
