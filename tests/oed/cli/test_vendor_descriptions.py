"""Descriptions as vendors publish them on their way through the commands: without masses, with an effort of 0."""

from __future__ import annotations

import json

import numpy as np
import pandas as pd
import pytest

from oed.exports import read_trajectory
from tests.robots.test_vendor_descriptions import BODY, arm

SMALL = ("--harmonics", 2, "--base-frequency", 0.2, "--periods", 1, "--no-strokes", "--workers", 1)
QUICK = ("--effort", "quick", "--friction", "coulomb-viscous", *SMALL, "--time-limit", 1)


def true_bodies():
    """The masses that the vendor does not publish."""
    return [BODY.format(mass) for mass in (6, 4, 2)]


def recorded(path, motion, folder):
    """A log of the true arm by pinocchio, with viscous and Coulomb friction."""
    pin = pytest.importorskip("pinocchio", reason="pinocchio is the plant of this test")
    model = pin.buildModelFromUrdf(str(path))
    data = model.createData()
    rows = zip(motion.q, motion.dq, motion.ddq, strict=True)
    tau = np.array([pin.rnea(model, data, *row) for row in rows])
    tau += 3 * motion.dq + 2 * np.tanh(motion.dq / 1e-3) + np.random.default_rng(0).normal(0, 0.05, tau.shape)
    columns = {f"q{i + 1}": motion.q[:, i] for i in range(3)} | {f"tau{i + 1}": tau[:, i] for i in range(3)}
    log = folder / "log.csv"
    pd.DataFrame({"t": motion.t} | columns).to_csv(log, index=False)
    return log


@pytest.mark.slow
def test_an_arm_without_masses_is_designed_for_and_identified(run, tmp_path):
    """Without masses, design, check and identify work, to the noise; simulate says what it needs and how to get it."""
    path = tmp_path / "arm.urdf"
    path.write_text(arm())
    done = run("design", "--robot", path, *QUICK, "--out", tmp_path / "d")
    assert done.code == 0, done.err
    assert "the masses of all links are not stated" in done.err
    motion, _ = read_trajectory(tmp_path / "d" / "trajectory.csv")
    truth = tmp_path / "true.urdf"
    truth.write_text(arm(true_bodies()))
    log = recorded(truth, motion, tmp_path)
    assert "usable" in run("check", log, "--robot", path).out
    done = run("identify", "--robot", path, "--log", log, "--friction", "coulomb-viscous", "--out", tmp_path / "m")
    assert done.code == 0, done.err
    found = {row["name"]: row for row in json.loads((tmp_path / "m" / "model.json").read_text())["parameters"]}
    # First moment of the last link: 2 kg at 0.1 m; its joint's viscous friction.
    for name, true in (("mPz_3", 0.2), ("f2_3", 3.0)):
        assert found[name]["value"] == pytest.approx(true, abs=4 * found[name]["standard_error"])
        assert found[name]["standard_error"] < 0.02 * true
    done = run(
        "simulate", "--robot", path, "--trajectory", tmp_path / "d" / "trajectory.csv", "--out", tmp_path / "s.csv"
    )
    assert done.code == 2
    assert "joint 1: a virtual robot needs masses, which the description of nomass does not state" in done.err
    assert "--assume-masses KG" in done.err


@pytest.mark.slow
def test_assumed_masses_are_said_everywhere(run, tmp_path):
    """With --assume-masses an arm is simulated; design.json, report, log and terminal say that they are assumed."""
    path = tmp_path / "arm.urdf"
    path.write_text(arm())
    words = "masses of all links (usual for 3 kg payload and 0.6 m reach)"
    done = run("design", "--robot", path, "--assume-masses", 3, *QUICK, "--out", tmp_path / "d")
    assert done.code == 0, done.err
    assert words in done.err
    assert words in json.loads((tmp_path / "d" / "design.json").read_text())["assumed"]
    assert words in (tmp_path / "d" / "report.html").read_text()
    log = tmp_path / "s.csv"
    trajectory = tmp_path / "d" / "trajectory.csv"
    done = run("simulate", "--robot", path, "--assume-masses", 3, "--trajectory", trajectory, "--out", log, "--json")
    assert done.code == 0, done.err
    assert words in done.err
    assert done.data["assumed"] == [words]
    assert words in log.read_text()
    assert words in run("robot", "show", path, "--assume-masses", 3).out


@pytest.mark.slow
@pytest.mark.parametrize("torque", ["--torque", "--no-torque"])
def test_an_effort_of_zero_does_not_stop_a_design(torque, run, tmp_path):
    """effort="0" is unknown: the design is written with torque limits of null, with and without --no-torque."""
    path = tmp_path / "arm.urdf"
    path.write_text(arm([BODY.format(30)] * 3, effort=0))
    done = run("design", "--robot", path, *QUICK, torque, "--out", tmp_path / "d")
    assert done.code == 0, done.err
    assert "joints a1, a2, a3: <limit> has effort 0, which stands for unknown" in done.err
    margins = json.loads((tmp_path / "d" / "design.json").read_text())["smallest_margins"]
    assert all(margin["limit"] is None for margin in margins if margin["quantity"] == "torque")


def test_a_velocity_of_zero_is_asked_for(run, tmp_path):
    """velocity="0" is unknown, which no default can be safe for: the refusal says where to state it."""
    path = tmp_path / "arm.urdf"
    path.write_text(arm().replace('velocity="2"', 'velocity="0"'))
    done = run("design", "--robot", path, *QUICK, "--out", tmp_path / "d")
    assert done.code == 2
    assert "joint 1: has no velocity limit; state it: velocity of <limit> in a URDF (0 stands for unknown)" in done.err
