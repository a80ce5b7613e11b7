"""Specification of logs of another robot: they are named, and right logs of a description that is 20 % off are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimation import read_log
from estimation.gate import check_log
from robots.geometry.chain import Joint
from robots.loading import load_robot
from robots.plants import Sensors, nominal_plant, simulate
from tests.estimation.gate.findings_of import found


@pytest.fixture(scope="module")
def gantry(er3a):
    """The six joints on other axes: each turned by a right angle about an axis of its own."""
    axes = ("x", "x", "y", "x", "x", "y")
    turns = {"x": np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]), "y": np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])}
    joints = [
        Joint(joint.name, joint.kind, np.asarray(joint.rotation) @ turns[axis], joint.translation, joint.axis)
        for joint, axis in zip(er3a.chain.joints, axes, strict=True)
    ]
    return replace(er3a, chain=replace(er3a.chain, joints=tuple(joints)))


@pytest.mark.slow
def test_a_log_of_another_robot_is_named_alone(er3a, gantry, good):
    """The log is said to be of another robot, and no meaning of its columns is advised beside it."""
    report = check_log(gantry, good())
    assert [finding.name for finding in report.findings] == ["other_robot"]
    assert report.refused
    assert "another robot" in report.findings[0].text
    # The other way round, with the log of the other robot.
    plant = nominal_plant(gantry, friction="coulomb-viscous", sensors=Sensors())
    other = simulate(plant, _motion_of(good()), seed=3)
    assert found(check_log(gantry, other), "other_robot") == []
    assert len(found(check_log(er3a, other), "other_robot")) == 1


def _motion_of(log):
    from robots.signals import Motion

    dq = np.gradient(log.q, log.t, axis=0)
    return Motion(log.t, log.q, dq, np.gradient(dq, log.t, axis=0))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_a_description_that_is_off_is_no_other_robot(er3a, fourier_motion, seed):
    """Masses, frictions and lengths that are 20 % off, and much noise: the log is of the robot that is described."""
    rng = np.random.default_rng(seed)
    joints = tuple(
        replace(joint, translation=np.asarray(joint.translation) * (1 + 0.2 * rng.normal(size=3)))
        for joint in er3a.chain.joints
    )
    described = replace(er3a, chain=replace(er3a.chain, joints=joints))
    for noise in (0.02, 0.5):
        sensors = Sensors(torque_noise=noise)
        plant = nominal_plant(er3a, friction="coulomb-viscous", spread=0.2, seed=seed, sensors=sensors)
        log = simulate(plant, fourier_motion(er3a, seed, 20.0, 0.004), seed=seed)
        assert found(check_log(described, log), "other_robot") == []


@pytest.mark.slow
def test_a_spring_is_no_other_robot(er3a, good):
    """A strong spring at one joint is an effect that the model lacks, and not another robot."""
    log = good()
    tau = np.array(log.tau)
    tau[:, 2] += 3 * tau[:, 2].std() * np.sin(3 * log.q[:, 2])
    report = check_log(er3a, replace(log, tau=tau))
    assert found(report, "other_robot") == []
    assert found(report, "poorly_explained")


@pytest.mark.slow
@pytest.mark.longer
def test_measured_logs_are_of_their_robots(data):
    """Published logs, wholes and halves, are of the robot that their source describes."""
    pairs = [
        (load_robot("ur10"), read_log(data("ur10_unisa") / "exciting.parquet")),
        (load_robot("panda"), read_log(data("panda_gaz2019") / "traj1_first10s.parquet")),
    ]
    folder = data("kuka_lwr4_flobaroid")
    lwr = load_robot(folder / "kuka_lwr4.urdf")
    pairs += [(lwr, read_log(folder / f"{run}.parquet")) for run in ("run1", "run2")]
    for robot, log in pairs:
        half = len(log) // 2
        for part in (log, log.rows(slice(0, half)), log.rows(slice(half, None))):
            assert found(check_log(robot, part), "other_robot") == []
