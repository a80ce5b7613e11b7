"""Limits of a URDF on their way to a design: stated ones are kept, missing ones are refused."""

from __future__ import annotations

import json

import numpy as np
import pytest

from oed.exports import read_trajectory
from robots.limits import finite_jerk

BODY = (
    '<inertial><origin xyz="0.2 0 0"/><mass value="2"/>'
    '<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.03"/></inertial>'
)


def arm(limit):
    """A pendulum whose joint has this limit."""
    return (
        f'<robot name="arm" version="1.2"><link name="base"/><link name="a">{BODY}</link>'
        '<joint name="j" type="revolute"><parent link="base"/><child link="a"/><axis xyz="0 1 0"/>'
        f"{limit}</joint></robot>"
    )


def design(run, path, out, *more):
    """Designs a small experiment."""
    size = ("--harmonics", 2, "--base-frequency", 0.2, "--periods", 1, "--no-strokes", "--workers", 1)
    options = ("--effort", "quick", "--friction", "coulomb-viscous", *size, "--out", out)
    return run("design", "--robot", path, *options, *more)


@pytest.mark.slow
def test_acceleration_deceleration_and_jerk_are_kept(run, tmp_path):
    """A design keeps the smaller one of acceleration and deceleration, and the jerk; design.json states both."""
    path = tmp_path / "arm.urdf"
    limit = '<limit lower="-2" upper="2" velocity="3" effort="80" acceleration="4.0" deceleration="2.0" jerk="90"/>'
    path.write_text(arm(limit))
    done = design(run, path, tmp_path / "d", "--time-limit", 1)
    assert done.code == 0, done.err
    assert "note: arm: joint j: acceleration and deceleration limits differ; the deceleration (2) counts" in done.err
    motion, _ = read_trajectory(tmp_path / "d" / "trajectory.csv")
    # Numbers of the file are rounded to the last bit only.
    assert 1.0 < np.abs(motion.ddq).max() <= 2.0 + 1e-9
    assert np.abs(finite_jerk(motion)[1]).max() <= 90.0 + 1e-6
    margins = json.loads((tmp_path / "d" / "design.json").read_text())["smallest_margins"]
    stated = {margin["quantity"]: (margin["limit"], margin["unit"]) for margin in margins}
    assert stated["acceleration"] == (2.0, "rad/s2")
    assert stated["jerk"] == (90.0, "rad/s3")


@pytest.mark.parametrize("command", ["design", "campaign", "pareto"])
def test_missing_position_limits_are_refused(command, run, tmp_path):
    """Commands that plan motions refuse a joint without position limits: exit code 2, and nothing is written."""
    path = tmp_path / "arm.urdf"
    path.write_text(arm('<limit velocity="3" effort="80"/>'))
    done = run(command, "--robot", path, "--out", tmp_path / "d")
    assert done.code == 2
    assert "joint j: <limit> states no position limits" in done.err
    assert "--unlimited" in done.err
    assert not (tmp_path / "d").exists() or not list((tmp_path / "d").iterdir())


@pytest.mark.slow
def test_unlimited_accepts_them(run, tmp_path):
    """--unlimited designs without position limits, says so, and no warning of another library leaks."""
    path = tmp_path / "arm.urdf"
    path.write_text(arm('<limit lower="0" upper="0" velocity="3" effort="80"/>'))
    done = design(run, path, tmp_path / "d", "--unlimited", "--time-limit", 1)
    assert done.code == 0, done.err
    notes = [line for line in done.err.splitlines() if line.startswith("note:")]
    assert notes[0] == "note: arm: joint j: no position limits stated; positions are unlimited"
    assert len(notes) == 2  # and what is assumed
