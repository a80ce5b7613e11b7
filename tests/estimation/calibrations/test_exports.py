"""Files of a calibrated robot: read by others, they move as the calibrated chain does."""

from __future__ import annotations

import mujoco
import numpy as np
import pinocchio as pin
import pytest
import yaml
from scipy.spatial.transform import Rotation

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
    """The written robot is identified and designed for with the base parameters of its design."""
    (tmp_path / "robot.urdf").write_text(calibrated_urdf(calibrated))
    from robots.base_parameters import find_base_parameters
    from robots.regressor import default_model

    robot = load_robot(tmp_path / "robot.urdf", unlimited=True)
    found, designed = (find_base_parameters(default_model(one)) for one in (robot, calibrated.robot))
    assert found.names == designed.names


def turned(axis, angle):
    """A turn about x, y or z (4, 4), in plain numpy."""
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("xyz"[axis], angle).as_matrix()
    return pose


def shifted(axis, length):
    pose = np.eye(4)
    pose[axis, 3] = length
    return pose


@pytest.mark.parametrize("convention", ["modified", "standard"])
@pytest.mark.parametrize("which", ["", "nominal_"])
def test_dh_tables_move_the_flange_as_the_chain(calibrated, convention, which):
    """The product of the table's own matrices, row by row as its head states them, is the flange of the robot."""
    lines = dh_text(calibrated, convention).splitlines()
    poses = [
        np.array([[float(x) for x in row.split()] for row in line.split(": ")[1].split(";")])
        for line in lines
        if line.startswith("# f") and "calibrated" in line
    ]
    names, *rows = [line.split(",") for line in lines if not line.startswith("#")]
    robot = calibrated.corrected if not which else calibrated.robot
    q = random_positions(robot, 4, seed=5)
    found = []
    for x in q:
        pose = np.eye(4)
        for joint, cells in enumerate(rows):
            row = dict(zip(names, cells, strict=True))
            alpha, a, beta, d, offset = (float(row[which + n]) for n in ("alpha", "a", "beta", "d", "offset"))
            turn = turned(2, x[joint] + offset)
            if convention == "modified":
                pose = pose @ turned(0, alpha) @ shifted(0, a) @ turned(1, beta) @ turn @ shifted(2, d)
            else:
                pose = pose @ turn @ shifted(2, d) @ shifted(0, a) @ turned(0, alpha) @ turned(1, beta)
        found.append(pose)
    flange = robot.chain.flange(q)
    if which:
        # The head has the calibrated ends: of the nominal table, the way between two poses is compared.
        ends = [np.linalg.inv(found[0]) @ pose for pose in found]
        own = [np.linalg.inv(flange[0]) @ pose for pose in flange]
        # They differ by one constant turn of the flange: angles of turns are the same.
        angles = [np.trace(pose[:3, :3]) for pose in ends], [np.trace(pose[:3, :3]) for pose in own]
        np.testing.assert_allclose(*angles, atol=1e-7)
    else:
        # Numbers have nine digits.
        np.testing.assert_allclose([poses[0] @ pose @ poses[1] for pose in found], flange, atol=2e-8)


def test_controllers_take_the_zeros():
    """A nominal arm in plain numpy at readings plus zeros is where an arm with those zeros was measured."""
    robot = load_robot("ur10")
    truth = oracle.Errors.none(6)
    truth.zero = np.array([0.0, 4e-3, -3e-3, 2e-3, 5e-3, 0.0])
    arm, q = oracle.Arm.of(robot), random_positions(robot, 5, seed=3)
    options = CalibrationOptions(kinds=("joint_zero",), diagnose=False)
    text = zeros_text(calibrate(robot, measured(robot, 40, truth, seed=1, noise=1e-7), options=options))
    zeros = np.array([yaml.safe_load(text)["joint_zeros"][name] for name in robot.joint_names])
    found, wanted = oracle.flange(arm, q + zeros, oracle.Errors.none(6)), oracle.flange(arm, q, truth)
    # The zeros of the first and last joint are those of the tracker and the tool; the noise moves others by 1e-7.
    np.testing.assert_allclose(found[:, :3, 3], wanted[:, :3, 3], atol=1e-6)


def test_tables_state_before_and_after(calibrated):
    """The tables have a row per joint, and the zeros are those of the calibration."""
    for convention in ("modified", "standard"):
        rows = [line for line in dh_text(calibrated, convention).splitlines() if not line.startswith("#")]
        assert len(rows) == 1 + calibrated.robot.n
    text = zeros_text(calibrated)
    for name, value in calibrated.joint_zeros.items():
        assert f"{name}: {value:.9g}" in text
