"""A small arm and a motion that excites it; the six-joint robot's experiment."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import ArrayLike

from robots.geometry.chain import Chain, Joint
from robots.limits import Limits
from robots.plants import Plant, Sensors, nominal_plant, simulate
from robots.robot import Robot
from robots.signals import Log, Motion


def _fourier_motion(robot: Robot, seed: int = 0, duration: float = 20.0, period: float = 0.004) -> Motion:
    """Five harmonics of 0.1 Hz, up to 0.9 of the range or 0.7 of the velocity; derivatives in closed form."""
    rng = np.random.default_rng(seed)
    t = period * np.arange(round(duration / period))
    w = 2 * np.pi * 0.1 * np.arange(1, 6)
    a, b = rng.normal(size=(2, 5, robot.n))
    s, c = np.sin(np.outer(t, w)), np.cos(np.outer(t, w))
    q = s @ (a / w[:, None]) - c @ (b / w[:, None])
    dq, ddq = c @ a + s @ b, c @ (b * w[:, None]) - s @ (a * w[:, None])
    lower, upper = np.maximum(robot.limits.lower, -np.pi), np.minimum(robot.limits.upper, np.pi)
    scale = np.minimum(0.9 * (upper - lower) / np.ptp(q, axis=0), 0.7 * robot.limits.velocity / np.abs(dq).max(axis=0))
    middle = (lower + upper) / 2 - scale * (q.max(axis=0) + q.min(axis=0)) / 2
    return Motion(t=t, q=scale * q + middle, dq=scale * dq, ddq=scale * ddq)


@pytest.fixture(scope="session")
def fourier_motion() -> Callable[..., Motion]:
    """Build a periodic motion of a robot from a seed."""
    return _fourier_motion


@pytest.fixture(scope="session")
def arm() -> Robot:
    """Two joints about a horizontal axis, with friction, rotors and torque constants."""
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    joints = (
        Joint("shoulder", "revolute", turn, np.zeros(3), np.array([0.0, 0.0, 1.0])),
        Joint("elbow", "revolute", np.eye(3), np.array([0.4, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])),
    )
    two = np.ones(2)
    return Robot(
        name="arm",
        chain=Chain(joints),
        limits=Limits(
            lower=-2 * two, upper=2 * two, velocity=4 * two, acceleration=30 * two, jerk=500 * two, torque=100 * two
        ),
        inertia=np.array(
            [[4.0, 0.8, 0.0, 0.0, 0.02, 0.0, 0.0, 0.3, 0.0, 0.3], [2.0, 0.3, 0.1, 0.0, 0.01, 0.0, 0.0, 0.1, 0.0, 0.1]]
        ),
        rotor_inertia=np.array([0.2, 0.1]),
        friction=np.array([[2.0, 1.5, 0.0, 0.0], [1.0, 0.8, 0.0, 0.0]]),
        gear_ratio=100 * two,
        torque_constant=np.array([8.0, -5.0]),
    )


@pytest.fixture(scope="session")
def arm_plant(arm: Robot) -> Callable[..., Plant]:
    """Build the virtual arm, as described, with the given sensors and truth."""

    def build(velocity_scale: float = 1e-3, **sensors: float) -> Plant:
        return nominal_plant(arm, velocity_scale=velocity_scale, sensors=Sensors(**sensors))

    return build


@pytest.fixture(scope="session")
def arm_log(arm_plant: Callable[..., Plant]) -> Callable[..., Log]:
    """Simulate a log of the virtual arm."""

    def build(seed: int = 0, motion_seed: int = 0, **options: float) -> Log:
        plant = arm_plant(**options)
        return simulate(plant, _fourier_motion(plant.robot, motion_seed), seed=seed)

    return build


@pytest.fixture(scope="session")
def pinocchio_torque() -> Callable[..., np.ndarray]:
    """Evaluate a robot's rigid body by pinocchio, in any field of gravity, with a point mass on the flange."""

    def torque(
        robot: Robot,
        motion: Motion,
        gravity: ArrayLike | None = None,
        mass: float = 0.0,
        centre: ArrayLike = (0.0, 0.0, 0.0),
    ) -> np.ndarray:
        model = pin.Model()
        parent = 0
        for joint, body in zip(robot.chain.joints, robot.inertia, strict=True):
            placement = pin.SE3(np.asarray(joint.rotation), np.asarray(joint.translation))
            parent = model.addJoint(
                parent, pin.JointModelRevoluteUnaligned(np.asarray(joint.axis)), placement, joint.name
            )
            # Pinocchio's order of the tensor: xx xy yy xz yz zz.
            inertia = pin.Inertia.FromDynamicParameters(body[[0, 1, 2, 3, 4, 5, 7, 6, 8, 9]])
            model.appendBodyToJoint(parent, inertia, pin.SE3.Identity())
        if mass:
            tip = np.asarray(robot.chain.tip)
            at = tip[:3, :3] @ np.asarray(centre) + tip[:3, 3]
            model.appendBodyToJoint(parent, pin.Inertia(mass, at, np.zeros((3, 3))), pin.SE3.Identity())
        model.gravity.linear = np.asarray(robot.chain.gravity if gravity is None else gravity, dtype=float)
        data = model.createData()
        return np.array([pin.rnea(model, data, *state) for state in zip(motion.q, motion.dq, motion.ddq, strict=True)])

    return torque


@pytest.fixture(scope="session")
def upright(arm: Robot) -> Robot:
    """Three joints, the first about the vertical: gravity never acts on it while the base stands level."""
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    axis = np.array([0.0, 0.0, 1.0])
    joints = (
        Joint("waist", "revolute", np.eye(3), np.array([0.0, 0.0, 0.3]), axis),
        Joint("shoulder", "revolute", turn, np.array([0.1, 0.0, 0.0]), axis),
        Joint("elbow", "revolute", np.eye(3), np.array([0.4, 0.0, 0.0]), axis),
    )
    three = np.ones(3)
    waist = [6.0, 0.3, 0.2, 0.5, 0.2, 0.0, 0.0, 0.2, 0.0, 0.25]
    return Robot(
        name="upright",
        chain=Chain(joints),
        limits=Limits(
            lower=-2 * three,
            upper=2 * three,
            velocity=4 * three,
            acceleration=30 * three,
            jerk=500 * three,
            torque=100 * three,
        ),
        inertia=np.vstack([waist, arm.inertia]),
        rotor_inertia=np.array([0.3, 0.2, 0.1]),
        friction=np.array([[2.0, 1.5, 0.0, 0.0], [2.0, 1.5, 0.0, 0.0], [1.0, 0.8, 0.0, 0.0]]),
    )
