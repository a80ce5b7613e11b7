"""MuJoCo models on the command line: read by ``--robot``, written by ``--mjcf``."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from robots import load_robot
from robots.regressor import default_model
from tests.robots.mujoco_models.arms import GANTRY, inverse_dynamics, states

PERIOD, ROWS = 0.004, 3000


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """A log of MuJoCo's inverse dynamics: a heavier carriage and more damping than the model states; some noise."""
    folder = tmp_path_factory.mktemp("mujoco")
    (folder / "original.xml").write_text(GANTRY)
    real = GANTRY.replace('mass="8"', 'mass="9.5"').replace('damping="30"', 'damping="45"')
    rng = np.random.default_rng(0)
    t = np.arange(ROWS) * PERIOD
    phases = 2 * np.pi * 0.1 * t[:, None] * np.arange(1, 6)
    a, b = rng.normal(size=(2, 5, 2)) / np.arange(1, 6)[:, None]
    size = np.array([0.3, 1.0]) / np.abs(np.sin(phases) @ a + np.cos(phases) @ b).max(axis=0)
    rate = 2 * np.pi * 0.1 * np.arange(1, 6)[:, None]
    q = (np.sin(phases) @ a + np.cos(phases) @ b) * size
    dq = (np.cos(phases) @ (a * rate) - np.sin(phases) @ (b * rate)) * size
    ddq = -(np.sin(phases) @ (a * rate**2) + np.cos(phases) @ (b * rate**2)) * size
    model = mujoco.MjModel.from_xml_string(real)
    tau = inverse_dynamics(model, ("rail", "swing"), q, dq, ddq, solver_friction=False)
    tau += rng.normal(size=tau.shape) * 0.005 * tau.std(axis=0)
    table = np.column_stack([t, q, tau])
    np.savetxt(folder / "log.csv", table, delimiter=",", header="t,q1,q2,tau1,tau2", comments="")
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("command", ["identify", "diagnose"])
def test_mjcf(run, log, tmp_path, command):
    """The written file is nearer to the real robot than the original, and --json says what it states."""
    path = tmp_path / "corrected.xml"
    options = ("--friction", "coulomb-viscous", "--out", tmp_path / "out")
    arguments = (command, "--robot", log / "original.xml", "--log", log / "log.csv", "--mjcf", path, *options)
    done = run(*arguments, "--json")
    assert done.code == 0, done.err
    assert done.data["mjcf"]["stated"][:4] == ["inertials", "armature", "damping", "frictionloss"]
    q, dq, ddq = states(2)
    real = mujoco.MjModel.from_xml_string(
        GANTRY.replace('mass="8"', 'mass="9.5"').replace('damping="30"', 'damping="45"')
    )
    expected = inverse_dynamics(real, ("rail", "swing"), q, dq, ddq, solver_friction=False)
    errors = []
    for file in (log / "original.xml", path):
        robot = load_robot(file)
        model = default_model(robot, friction="coulomb-viscous")
        errors.append(np.sqrt(np.mean((model.torque(q, dq, ddq, model.nominal) - expected) ** 2, axis=0)))
    # The swing was right before, and noise of half a percent makes some error.
    assert errors[1][0] < 0.2 * errors[0][0]
    assert errors[1][1] < 0.03 * expected[:, 1].std()
    again = run(*arguments[:-1], tmp_path / "other")
    assert again.code == 2
    assert "corrected.xml" in again.err
    assert not (tmp_path / "other").exists()


def test_a_wrong_file_ends_with_code_2(run, tmp_path):
    """A fault of the model is one message, before any log is read."""
    (tmp_path / "arm.xml").write_text(GANTRY.replace('mass="8"', 'mass="-8"'))
    done = run("identify", "--robot", tmp_path / "arm.xml", "--log", tmp_path / "none.csv", "--out", tmp_path / "out")
    assert done.code == 2
    assert "MuJoCo cannot load it" in done.err
    assert done.err.count("\n") == 1


def test_mjcf_does_not_go_with_limits(run, log, tmp_path):
    """Detection limits have no model to write."""
    done = run("diagnose", "--robot", log / "original.xml", "--limits", "--mjcf", tmp_path / "corrected.xml")
    assert done.code == 2
    assert "--mjcf" in done.err
