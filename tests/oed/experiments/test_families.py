"""Designs with each family of the optimised part: all limits, files, reports."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace

import casadi
import numpy as np
import pytest

import oed
from oed.constraints.tool import ToolBox
from oed.experiments import Effort, InteriorPoint
from oed.reports import save_report
from robots.common.errors import InfeasibleError, InputError
from robots.common.files import ResultFolder
from robots.loading import load_robot

EFFORT = Effort(islands=1, starts=1, screened=20, hops=0, finish_samples=60)
SEARCH = oed.SearchOptions(effort=EFFORT, solver=InteriorPoint(max_iter=30, finish_iter=15), workers=1)
MODEL = oed.ModelOptions(friction="coulomb-viscous")
OTHERS = pytest.mark.parametrize("name", ["bspline", "fourier-polynomial"])


@pytest.mark.slow
@OTHERS
def test_all_limits_at_once(name):
    """With tight torque, collisions and a tool box, the whole experiment keeps everything, as its own samples show."""
    robot = load_robot("er3a")
    weak = replace(robot, limits=replace(robot.limits, torque=0.6 * np.asarray(robot.limits.torque)))
    design = oed.design(
        weak,
        model=MODEL,
        trajectory=oed.TrajectoryOptions(family=name, periods=2),
        limits=oed.LimitOptions(collision=True, space=[ToolBox(lower=(-np.inf, -np.inf, 0.1), upper=(np.inf,) * 3)]),
        search=SEARCH,
    )
    assert design.success
    assert design.freedom["certified"]
    assert min(margin.slack_fraction for margin in design.check()) >= 0
    for end in (0, -1):
        np.testing.assert_allclose(design.motion.dq[end], 0.0, atol=1e-9)
        np.testing.assert_allclose(design.motion.ddq[end], 0.0, atol=1e-7)
    part = design.part("excitation")
    # Two repetitions are alike.
    half = len(part) // 2
    np.testing.assert_allclose(part.q[:half], part.q[half:], atol=1e-9)


@pytest.mark.slow
@OTHERS
def test_limits_hold_between_the_samples(name):
    """On a grid 40 times as fine as the file no joint limit is passed."""
    robot = load_robot("er3a")
    plan = oed.TrajectoryOptions(family=name, periods=1, strokes=False)
    design = oed.design(robot, model=MODEL, trajectory=plan, search=SEARCH)
    made = oed.TrajectoryOptions(family=name).excitation
    motion = made.trajectory(design.coefficients)
    q, dq, ddq, dddq = motion.sample(np.arange(0.0, motion.duration, 1e-4))
    limits = robot.limits
    assert np.all((q >= limits.lower) & (q <= limits.upper))
    for values, bound in ((dq, limits.velocity), (ddq, limits.acceleration), (dddq, limits.jerk)):
        assert np.all(np.abs(values) <= bound)


@pytest.mark.slow
@OTHERS
def test_file_and_report(name, tmp_path):
    """A saved design names its family, reads back the same, and has a report."""
    robot = load_robot("er3a")
    plan = oed.TrajectoryOptions(family=name, periods=1, strokes=False)
    design = oed.design(robot, model=MODEL, trajectory=plan, search=SEARCH)
    with ResultFolder(tmp_path / "out", False, names=["report.html"]) as folder:
        design.save(folder.path("report.html").parent)
        save_report(design, folder)
    data = json.loads((tmp_path / "out" / "design.json").read_text(encoding="utf-8"))
    assert "fourier" not in data
    assert data["excitation"]["family"] == plan.excitation.settings()
    assert {segment["kind"] for segment in data["segments"]} == {"approach", "excitation", "move"}
    again = oed.Design.load(tmp_path / "out")
    np.testing.assert_array_equal(again.coefficients, design.coefficients)
    assert again.to_dict() == design.to_dict()
    assert repr(again) == repr(design)
    assert repr(design).startswith("Design('er3a', ")
    assert "excitation" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


@dataclass(frozen=True, kw_only=True)
class Power(oed.StateLimit):
    """Sum of squared joint speeds, over a bound; with more names than rows on request."""

    bound: float = 1.0
    extra: bool = False
    shift: float = 0.0

    def names(self, robot):
        return ("joint speeds",) + (("another",) if self.extra else ())

    def rows(self, frames, dq, ddq):
        return casadi.sumsqr(dq) / self.bound + self.shift


@pytest.mark.slow
@pytest.mark.longer
def test_own_limit_of_motion_decides_and_is_reported():
    """An own limit is used up by the optimised part, kept by the whole experiment, and stated with its margin.

    The robot is given by its name in the catalogue.
    """
    limit = Power(bound=4.0)
    options = {"model": MODEL, "search": SEARCH, "trajectory": oed.TrajectoryOptions(periods=1)}
    free = oed.design("er3a", **options)
    kept = oed.design("er3a", limits=oed.LimitOptions(motion=[limit]), **options)
    assert free.robot.name == "er3a"
    assert free.success
    assert np.square(free.part("fourier").dq).sum(axis=1).max() > 8.0
    assert 3.5 < np.square(kept.motion.dq).sum(axis=1).max() <= 4.0
    (near,) = kept.space
    assert near.limit == "joint speeds"
    assert 0.0 <= near.value < 0.1
    assert kept.success


@pytest.mark.slow
@pytest.mark.parametrize(
    ("limits", "error", "message"),
    [
        ({"motion": [Power(extra=True)]}, InputError, r"Power\(.*rows of shape \(1, 1\); allowed: \(2, 1\)"),
        ({"motion": [Power(shift=1.5)]}, InfeasibleError, "'joint speeds' is at 1.5 times its bound"),
        ({"motion": [3]}, InputError, "the limit 3; allowed: a subclass of StateLimit"),
        ({"space": [Power()]}, InputError, "allowed: a subclass of GeometricLimit"),
    ],
)
def test_own_limits_with_a_fault(limits, error, message):
    """A wrong number of rows, a limit that rest breaks, and what is no limit are one message each."""
    with pytest.raises(error, match=message):
        oed.design("er3a", limits=oed.LimitOptions(**limits), search=SEARCH)
