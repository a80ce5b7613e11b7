"""A three-joint arm whose model is exact, its pinocchio twin, and logs of it with pushes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from estimation.models.model import Model
from robots.base_parameters import find_base_parameters
from robots.geometry.chain import Chain
from robots.plants import Sensors, nominal_plant, simulate
from robots.regressor import default_model
from robots.robot import Robot
from robots.signals import Log, Motion


def exact_model(robot: Robot, friction: str = "coulomb-viscous") -> Model:
    """The model of a robot's own description, as if it had been identified without errors."""
    base = find_base_parameters(default_model(robot, friction=friction, velocity_scale=1e-3))
    return Model(
        torque_model=base.model,
        columns=base.independent,
        values=base.from_standard(base.model.nominal),
        covariance=np.eye(base.size) * 1e-12,
        determined=np.ones(base.size, dtype=bool),
        formulas=base.formulas(),
        provenance={"cutoff_hz": 20.0},
    )


class Twin:
    """The same chain in pinocchio."""

    def __init__(self, robot: Robot) -> None:
        self.model = pin.Model()
        self.joints, parent = [], 0
        for joint, body in zip(robot.chain.joints, robot.inertia, strict=True):
            place = pin.SE3(np.asarray(joint.rotation), np.asarray(joint.translation))
            kind = pin.JointModelRevoluteUnaligned(np.asarray(joint.axis))
            parent = self.model.addJoint(parent, kind, place, joint.name)
            self.joints.append(parent)
            inertia = pin.Inertia.FromDynamicParameters(body[[0, 1, 2, 3, 4, 5, 7, 6, 8, 9]])
            self.model.appendBodyToJoint(parent, inertia, pin.SE3.Identity())
        self.model.gravity.linear = np.asarray(robot.chain.gravity, dtype=float)
        self.data = self.model.createData()
        self.tip = np.asarray(robot.chain.tip)

    def jacobian(self, q: np.ndarray, link: int | None = None, point: np.ndarray | None = None) -> np.ndarray:
        """(6, n) in the base frame of a point in a link's frame; of the flange by default."""
        at = self.tip[:3, 3] if point is None else point
        joint = self.joints[-1 if link is None else link - 1]
        frame = pin.Frame("point", joint, 0, pin.SE3(np.eye(3), at), pin.FrameType.OP_FRAME)
        model = self.model.copy()
        index = model.addFrame(frame)
        return pin.computeFrameJacobian(model, model.createData(), q, index, pin.LOCAL_WORLD_ALIGNED)


@pytest.fixture(scope="session")
def twin_of() -> type[Twin]:
    return Twin


@pytest.fixture(scope="session")
def limb(upright: Robot) -> Robot:
    """The three-joint arm with a flange at the end of its last link, where all joints feel a force."""
    chain = upright.chain
    tip = np.eye(4)
    tip[:3, 3] = [0.35, 0.05, 0.02]
    return replace(upright, chain=Chain(chain.joints, gravity=chain.gravity, tip=tip))


@pytest.fixture(scope="session")
def exact(limb: Robot) -> Model:
    """The exact model of the three-joint arm."""
    return exact_model(limb)


@pytest.fixture(scope="session")
def model_of() -> Callable[..., Model]:
    return exact_model


def _motion(robot: Robot, seed: int, duration: float, period: float = 0.008) -> Motion:
    """Twelve sinusoids per joint that do not repeat; derivatives in closed form."""
    rng, t = np.random.default_rng(seed), period * np.arange(round(duration / period))
    w, phase = 2 * np.pi * rng.uniform(0.05, 0.5, (12, robot.n)), rng.uniform(0, 2 * np.pi, (12, robot.n))
    size = rng.normal(size=(12, robot.n)) / w * 0.25
    angle = t[:, None, None] * w + phase
    return Motion(
        t=t,
        q=(size * np.sin(angle)).sum(axis=1),
        dq=(size * w * np.cos(angle)).sum(axis=1),
        ddq=-(size * w**2 * np.sin(angle)).sum(axis=1),
    )


@pytest.fixture(scope="session")
def pushed_log(limb: Robot) -> Callable[..., Log]:
    """Simulates the arm with 1 % coloured noise, and adds pushes at the flange by pinocchio's Jacobian."""
    plant, twin = nominal_plant(limb, friction="coulomb-viscous", sensors=Sensors(torque_noise=0.01)), Twin(limb)

    def build(
        seed: int,
        pushes: tuple[tuple[float, float, tuple[float, float, float]], ...] = (),
        duration: float = 20.0,
    ) -> Log:
        motion = _motion(limb, seed, duration)
        log = simulate(plant, motion, seed=seed)
        tau = np.array(log.tau)
        for at, length, force in pushes:
            for k in np.flatnonzero((log.t >= at) & (log.t < at + length)):
                tau[k] -= twin.jacobian(motion.q[k])[:3].T @ np.array(force)
        return replace(log, tau=tau, dq=motion.dq, name=f"log {seed}")

    return build


@pytest.fixture(scope="session")
def log_with_stops(limb: Robot) -> Callable[[int], Log]:
    """Sixty moves of 0.8 s between random points, with rests of 0.8 s, at which friction holds any torque."""
    plant, step = nominal_plant(limb, friction="coulomb-viscous", sensors=Sensors(torque_noise=0.01)), 0.008
    x = np.linspace(0.0, 1.0, 100, endpoint=False)
    shapes = (10 * x**3 - 15 * x**4 + 6 * x**5, 30 * x**2 - 60 * x**3 + 30 * x**4, 60 * x - 180 * x**2 + 120 * x**3)

    def build(seed: int) -> Log:
        rng = np.random.default_rng(seed)
        points, parts = rng.uniform(-0.8, 0.8, (61, limb.n)), []
        for order, (shape, end) in enumerate(zip(shapes, (1.0, 0.0, 0.0), strict=True)):
            whole = np.concatenate([shape, np.full(100, end)]) / 0.8**order
            parts.append(np.concatenate([whole[:, None] * change for change in np.diff(points, axis=0)]))
        q, dq, ddq = parts
        q += np.repeat(points[:-1], 200, axis=0)
        log = simulate(plant, Motion(t=step * np.arange(len(q)), q=q, dq=dq, ddq=ddq), seed=seed)
        held = np.repeat(rng.uniform(-1.0, 1.0, (60, limb.n)), 200, axis=0) * np.asarray(limb.friction)[:, 0]
        return replace(log, tau=np.asarray(log.tau) + np.where(dq == 0.0, held, 0.0), name=f"stops {seed}")

    return build
