"""A SCARA arm from design to model: the slide is in metres and newtons wherever it appears."""

from __future__ import annotations

import json

import numpy as np
import pytest

from estimation.logs import read_log
from oed.exports import write_trajectory
from robots.common.tables.table_files import read_table
from robots.loading import load_robot
from robots.signals import Motion


def _body(mass, x, size):
    moments = f'ixx="{size}" ixy="0" ixz="0" iyy="{size}" iyz="0" izz="{size}"'
    return f'<inertial><origin xyz="{x} 0 0"/><mass value="{mass}"/><inertia {moments}/></inertial>'


@pytest.fixture
def scara(tmp_path):
    """Two arms and a slide."""
    joints = (("j1", "revolute", 100, 7), ("j2", "revolute", 50, 7), ("j3", "prismatic", 200, 1))
    text = '<robot name="scara"><link name="l0"/>'
    for i, (name, kind, effort, velocity) in enumerate(joints, start=1):
        text += f'<link name="l{i}">{_body(5 - i, 0.1, 0.02)}</link><joint name="{name}" type="{kind}">'
        text += f'<parent link="l{i - 1}"/><child link="l{i}"/><origin xyz="{0.3 if i > 1 else 0} 0 0"/>'
        text += (
            f'<axis xyz="0 0 1"/><limit lower="-0.15" upper="0.15" velocity="{velocity}" effort="{effort}"/></joint>'
        )
    path = tmp_path / "scara.urdf"
    path.write_text(text + "</robot>")
    return path


@pytest.fixture
def trajectory(tmp_path):
    """A bare trajectory, such as another program writes, at rest at both ends."""
    t = 0.004 * np.arange(1001)
    rate = 2 * np.pi * np.array([0.5, 1.0, 0.75])
    phase = np.outer(t, rate)
    motion = Motion(t, 0.05 * (1 - np.cos(phase)), 0.05 * rate * np.sin(phase), 0.05 * rate**2 * np.cos(phase))
    write_trajectory(tmp_path / "bare.csv", motion, bare=True)
    return tmp_path / "bare.csv", motion


def test_export_leaves_metres(run, scara, trajectory, tmp_path):
    """A file without units is exported in degrees with a note, and with the robot without one and rightly."""
    path, motion = trajectory
    reported = run("export", path, "--degrees", "--bare", "--out", tmp_path / "a.csv")
    assert "states no units: all joints are taken as revolute" in reported.err
    done = run("export", path, "--degrees", "--bare", "--robot", scara, "--out", tmp_path / "b.csv")
    assert done.code == 0
    assert "states no units" not in done.err
    rows = np.loadtxt(tmp_path / "b.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(rows[:, 1:4], np.column_stack([np.rad2deg(motion.q[:, :2]), motion.q[:, 2]]))


@pytest.mark.slow
def test_log_and_mapping(run, scara, trajectory, tmp_path):
    """Simulate states newtons of the slide; one unit of angles and one unit per joint read the same."""
    path, _ = trajectory
    log = tmp_path / "log.csv"
    assert run("simulate", "--robot", scara, "--trajectory", path, "--out", log).code == 0
    table = read_table(log)
    assert (table.units["q3"], table.units["tau3"], table.units["tau1"]) == ("m", "N", "N m")
    columns = {name: np.asarray(values, dtype=float) for name, values in table.columns.items()}
    read = []
    for number, (scale, unit) in enumerate(((1.0, "deg"), (1000.0, "[deg, deg, mm]"))):
        q = [np.rad2deg(columns["q1"]), np.rad2deg(columns["q2"]), columns["q3"] * scale]
        rows = np.column_stack([columns["t"], *q, columns["tau1"], columns["tau2"], columns["tau3"]])
        foreign, mapping = tmp_path / f"foreign{number}.csv", tmp_path / f"map{number}.yaml"
        np.savetxt(foreign, rows, delimiter=",", header="t,a0,a1,a2,tau1,tau2,tau3", comments="", fmt="%.17g")
        mapping.write_text(f'joints: [0, 1, 2]\nposition: {{columns: "a{{joint}}", unit: {unit}}}\n')
        read.append(read_log(foreign, mapping=mapping, kinds=load_robot(scara).chain.kinds))
    np.testing.assert_allclose(read[0].q, np.column_stack([columns[f"q{j}"] for j in (1, 2, 3)]), rtol=1e-12)
    np.testing.assert_allclose(read[1].q, read[0].q, rtol=1e-12)
    out = tmp_path / "model"
    arguments = ("--log", tmp_path / "foreign0.csv", "--mapping", tmp_path / "map0.yaml", "--out", out)
    done = run("identify", "--robot", scara, *arguments, "--friction", "coulomb-viscous", "--no-position")
    assert done.code == 0, done.err
    assert "the unit deg of q does not suit linear joint 3" in done.err + done.out
    found = {entry["name"]: entry for entry in json.loads((out / "model.json").read_text())["parameters"]}
    # The mass on the slide, read as if in degrees it would be 57 times as large.
    assert found["m_3"]["value"] == pytest.approx(2.0, rel=0.3)
    assert found["m_3"]["unit"] == "kg"
