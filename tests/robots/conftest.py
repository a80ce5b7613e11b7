"""Random robots, and pinocchio as an independent oracle of any chain's dynamics."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from robots.geometry.chain import Chain, Joint
from robots.limits import Limits
from robots.loading import load_robot
from robots.robot import Robot
from tests.robots.robot_files import URDF

TO_OURS = [0, 1, 2, 3, 4, 5, 7, 6, 8, 9]  # pinocchio lists Iyy before Ixz


@dataclass
class Twin:
    """A robot's chain in pinocchio."""

    pin: ModuleType
    model: object
    n: int

    def regressor(self, q, dq, ddq):
        """The rigid-body regressor (N, n, 10 n), in our order of parameters."""
        order = np.concatenate([10 * link + np.array(TO_OURS) for link in range(self.n)])
        data = self.model.createData()
        rows = [
            self.pin.computeJointTorqueRegressor(self.model, data, *state) for state in zip(q, dq, ddq, strict=True)
        ]
        return np.reshape(rows, (len(q), self.n, -1))[:, :, order]  # it drops the axis of a single joint

    def torque(self, q, dq, ddq, inertia):
        """The torque (N, n) of links with the given parameters (n, 10)."""
        for joint, row in enumerate(inertia, start=1):
            self.model.inertias[joint] = self.pin.Inertia.FromDynamicParameters(row[TO_OURS])
        data = self.model.createData()
        return np.array([self.pin.rnea(self.model, data, *state) for state in zip(q, dq, ddq, strict=True)])


def _twin(robot: Robot) -> Twin:
    pin = pytest.importorskip("pinocchio", reason="pinocchio is the oracle of these tests")
    model, parent = pin.Model(), 0
    model.gravity.linear = np.array(robot.chain.gravity)
    for joint in robot.chain.joints:
        kinds = {"revolute": pin.JointModelRevoluteUnaligned, "prismatic": pin.JointModelPrismaticUnaligned}
        placement = pin.SE3(np.array(joint.rotation), np.array(joint.translation))
        parent = model.addJoint(parent, kinds[joint.kind](np.array(joint.axis)), placement, joint.name)
    return Twin(pin, model, robot.n)


def _made(joints: list[Joint], gravity=(0.0, 0.0, -9.81), seed: int = 0) -> Robot:
    random, n = np.random.default_rng(seed), len(joints)
    ones = np.ones(n)
    inertia = []
    for _ in range(n):
        # The pseudo-inertia of a cloud of points is positive definite whatever their places.
        points, mass = random.normal(scale=0.2, size=(6, 3)), random.uniform(0.5, 5.0)
        second = mass * points.T @ points / len(points)
        moments = (np.trace(second) * np.eye(3) - second)[np.triu_indices(3)]
        inertia.append([mass, *(mass * points.mean(axis=0)), *moments])
    return Robot(
        name="made",
        chain=Chain(tuple(joints), gravity=np.array(gravity)),
        limits=Limits(lower=-ones, upper=ones, velocity=ones, acceleration=ones, jerk=ones, torque=ones),
        inertia=np.array(inertia),
        friction=random.uniform(0.1, 2.0, (n, 4)),
        rotor_inertia=random.uniform(0.1, 1.0, n),
    )


def _random_robot(seed: int, n: int) -> Robot:
    random = np.random.default_rng(seed)
    joints = []
    for i in range(n):
        rotation = np.linalg.qr(random.normal(size=(3, 3)))[0]
        rotation *= np.sign(np.linalg.det(rotation))
        kind = "prismatic" if random.random() < 0.3 else "revolute"
        joints.append(Joint(f"j{i + 1}", kind, rotation, random.normal(scale=0.4, size=3), random.normal(size=3)))
    gravity = random.normal(size=3)
    return _made(joints, 9.81 * gravity / np.linalg.norm(gravity), seed)


def _states(robot: Robot, samples: int, seed: int = 0):
    return np.random.default_rng(seed).uniform(-3, 3, (3, samples, robot.n))


@pytest.fixture(scope="session")
def twin() -> Callable[[Robot], Twin]:
    """Build a robot's twin in pinocchio."""
    return _twin


@pytest.fixture(scope="session")
def made_robot() -> Callable[..., Robot]:
    """Build a robot of joints, under a gravity, with random but possible links."""
    return _made


@pytest.fixture(scope="session")
def random_robot() -> Callable[[int, int], Robot]:
    """Build a robot of n joints of both kinds about oblique axes, under a gravity of any direction."""
    return _random_robot


@pytest.fixture(scope="session")
def states() -> Callable[..., np.ndarray]:
    """Draw random q, dq and ddq, each (N, n)."""
    return _states


@pytest.fixture(scope="session")
def catalogue_robot() -> Callable[[str], Robot]:
    """Load a robot of the catalogue, with random possible dynamics where it states none."""

    def load(name: str) -> Robot:
        robot = load_robot(name)
        return robot if robot.has_inertia else replace(robot, inertia=_made(list(robot.chain.joints)).inertia)

    return load


@pytest.fixture
def urdf(tmp_path: Path) -> Path:
    """The URDF of two joints."""
    path = tmp_path / "two.urdf"
    path.write_text(URDF)
    return path


@pytest.fixture
def write(tmp_path: Path) -> Callable[[str], Path]:
    """Write a robot's YAML file."""

    def write(text: str) -> Path:
        path = tmp_path / "robot.yaml"
        path.write_text(text)
        return path

    return write
