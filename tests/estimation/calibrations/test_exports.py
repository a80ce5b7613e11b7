"""Files of a calibrated robot: read by others, they move as the calibrated chain does."""

from __future__ import annotations

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from benchmarks.calibration_parts import oracle
from estimation import calibrate
from estimation.calibrations import CalibrationOptions
from estimation.calibrations.exports import calibrated_mjcf, calibrated_urdf, calibrated_yaml, dh_text, zeros_text
from robots import load_robot
from robots.geometry_errors import random_positions
from tests.estimation.calibrations.conftest import measured


@pytest.fixture(scope="module", params=["ur10", "er3a"])
def calibrated(request):
    robot = load_robot(request.param)
    truth = oracle.usual_errors(oracle.Arm.of(robot), np.random.default_rng(3))
    options = CalibrationOptions(kinds=("joint_zero", "link_placement"), diagnose=False)
    return calibrate(robot, measured(robot, 40, truth, seed=1), options=options)


def test_pinocchio_moves_the_urdf_as_the_chain(calibrated, tmp_path):
    """The last joint's frame of the written URDF is where the calibrated chain has it, by pinocchio."""
    path = tmp_path / "robot.urdf"
    path.write_text(calibrated_urdf(calibrated))
    model = pin.buildModelFromUrdf(str(path))
    data, robot = model.createData(), calibrated.corrected
    for q in random_positions(robot, 5, seed=2):
        index = [[np.cos(v), np.sin(v)] if model.joints[j + 1].nq == 2 else [v] for j, v in enumerate(q)]
        pin.forwardKinematics(model, data, np.concatenate(index))
        # Numbers are written in full.
        np.testing.assert_allclose(data.oMi[robot.n].homogeneous, robot.chain.transforms(q)[-1], atol=1e-11)


def test_mujoco_moves_the_mjcf_as_the_chain(calibrated):
    """The flange of the written MJCF is where the calibrated chain has it, by MuJoCo."""
    model = mujoco.MjModel.from_xml_string(calibrated_mjcf(calibrated))
    data = mujoco.MjData(model)
    for q in random_positions(calibrated.corrected, 5, seed=2):
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        np.testing.assert_allclose(data.site("flange").xpos, calibrated.corrected.chain.flange(q)[:3, 3], atol=1e-11)


def test_the_yaml_keeps_limits_and_flange(calibrated, tmp_path):
    """The written YAML has the calibrated flange, and limits and inertia as before."""
    (tmp_path / "robot.urdf").write_text(calibrated_urdf(calibrated))
    text = calibrated_yaml(calibrated, "robot.urdf")
    assert text is not None
    (tmp_path / "robot.yaml").write_text(text)
    robot, before = load_robot(tmp_path / "robot.yaml"), calibrated.robot
    q = random_positions(robot, 5, seed=2)
    np.testing.assert_allclose(robot.chain.flange(q), calibrated.corrected.chain.flange(q), atol=1e-11)
    for name in ("lower", "upper", "velocity", "acceleration", "jerk"):
        np.testing.assert_array_equal(getattr(robot.limits, name), getattr(before.limits, name))
    np.testing.assert_allclose(robot.inertia, before.inertia, atol=1e-9)


def test_identification_takes_the_calibrated_robot(calibrated, tmp_path):
    """The written robot is identified and designed for, as any other."""
    (tmp_path / "robot.urdf").write_text(calibrated_urdf(calibrated))
    from robots.base_parameters import find_base_parameters
    from robots.regressor import default_model

    robot = load_robot(tmp_path / "robot.urdf", unlimited=True)
    assert find_base_parameters(default_model(robot)).size >= find_base_parameters(default_model(calibrated.robot)).size


def test_tables_state_before_and_after(calibrated):
    """The tables have a row per joint, and the zeros are those of the calibration."""
    for convention in ("modified", "standard"):
        rows = [line for line in dh_text(calibrated, convention).splitlines() if not line.startswith("#")]
        assert len(rows) == 1 + calibrated.robot.n
    text = zeros_text(calibrated)
    for name, value in calibrated.joint_zeros.items():
        assert f"{name}: {value:.9g}" in text
