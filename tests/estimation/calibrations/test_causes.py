"""Causes: the one that is hidden is named, with its place, and nothing where there is nothing."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.calibration import CAUSES, hidden
from benchmarks.calibration_parts import oracle
from estimation.calibrations.causes import diagnose_geometry
from estimation.calibrations.fit import fit_geometry
from robots import load_robot
from robots.geometry_errors import GeometryModel, Markers, MeasuredPoses, error_term, random_positions
from robots.geometry_errors.poses import approaches


def causes_of(robot, poses):
    """The diagnosis beside a fit of zeros and links."""
    terms = [error_term("joint_zero"), error_term("link_placement")]
    return diagnose_geometry([robot], poses, fit_geometry(GeometryModel([robot], terms, poses))).to_dict()


@pytest.fixture(scope="module")
def robots():
    return [load_robot("ur10"), load_robot("panda")]


@pytest.mark.slow
@pytest.mark.parametrize("cause", CAUSES)
def test_the_hidden_cause_is_named_first(robots, cause):
    """Each of the seven causes is named first, at its joint, in an arm that shares no code with the diagnosis."""
    number = CAUSES.index(cause)
    robot, joint, poses = hidden(cause, number, robots)
    findings = causes_of(robot, poses)["findings"]
    assert (findings[0]["cause"], findings[0]["joint"]) == (cause, joint)
    assert findings[0]["p_value"] < 0.001
    # Each further cause would be one too many; one in 1,000 cases may have one.
    assert len(findings) == 1


@pytest.mark.slow
def test_nothing_is_named_where_nothing_is(robots):
    """An arm that is as described has no cause; the evidence of each is stated all the same."""
    robot, _, poses = hidden("none", 3, robots)
    found = causes_of(robot, poses)
    assert found["findings"] == []
    assert min(found["evidence"].values()) > 1e-4


@pytest.mark.slow
def test_smooth_errors_of_no_known_cause_are_unexplained(robots):
    """A field that bends all positions with the place is called unexplained, if no cause takes it up."""
    robot = robots[0]
    _, _, poses = hidden("none", 5, robots[:1])
    from dataclasses import replace

    places = poses.observed.reshape(len(poses.q), 3, 3)
    bent = places + 1e-3 * np.sin(6.0 * places[..., [1, 2, 0]])
    found = causes_of(robot, replace(poses, observed=bent.reshape(len(poses.q), -1)))["findings"]
    assert "unexplained" in {item["cause"] for item in found}


def test_backlash_by_load_is_told_from_backlash_by_approach():
    """A gap that gravity closes on one side is named with its size; the direction of approach is not blamed."""
    robot = load_robot("ur10")
    arm, rng = oracle.Arm.of(robot), np.random.default_rng(3)
    q = random_positions(robot, 60, seed=4)
    # Gravity moves the joint by half a gap to its side, as an arm in plain numpy has it.
    side = np.sign(oracle.gravity_torque(arm, q)[:, 2])
    read = q.copy()
    read[:, 2] -= 0.5 * 1.5e-3 * side
    observed = oracle.markers(oracle.flange(arm, q, oracle.Errors.none(6)), *oracle.usual_setup(rng))
    observed = observed + 5e-5 * rng.standard_normal(observed.shape)
    poses = MeasuredPoses(q=read, measurement=Markers(count=3), observed=observed, approach=approaches(read))
    terms = [error_term("load_backlash")]
    fit = fit_geometry(GeometryModel([robot], terms, poses))
    found = diagnose_geometry([robot], poses, fit).to_dict()["findings"]
    assert (found[0]["cause"], found[0]["joint"]) == ("load_backlash", 3)
    low, high = found[0]["parameters"][0]["ci95"]
    assert low < 1.5e-3 < high
    assert len(found) == 1
