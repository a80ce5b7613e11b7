"""A virtual arm with geometric errors in plain numpy and scipy: it shares no code with the calibration.

It takes the numbers of a description (placements, axes, masses) and computes the rest by itself: matrices are
multiplied joint by joint, turns are scipy's, and the torque of gravity is the derivative of the potential energy.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

SCARA = """<?xml version="1.0"?>
<robot name="scara">
  <link name="base"/>
  <link name="l1"><inertial><origin xyz="0.16 0 0"/><mass value="6"/>
    <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.08" iyz="0" izz="0.08"/></inertial></link>
  <link name="l2"><inertial><origin xyz="0.13 0 0.03"/><mass value="4"/>
    <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.05" iyz="0" izz="0.05"/></inertial></link>
  <link name="l3"><inertial><origin xyz="0 0 -0.1"/><mass value="1"/>
    <inertia ixx="0.004" ixy="0" ixz="0" iyy="0.004" iyz="0" izz="0.001"/></inertial></link>
  <link name="l4"><inertial><origin xyz="0 0 -0.02"/><mass value="0.5"/>
    <inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.001"/></inertial></link>
  <joint name="j1" type="revolute"><origin xyz="0 0 0.4"/><parent link="base"/><child link="l1"/><axis xyz="0 0 1"/>
    <limit lower="-2.3" upper="2.3" velocity="4" effort="100"/></joint>
  <joint name="j2" type="revolute"><origin xyz="0.325 0 0"/><parent link="l1"/><child link="l2"/><axis xyz="0 0 1"/>
    <limit lower="-2.4" upper="2.4" velocity="4" effort="60"/></joint>
  <joint name="j3" type="prismatic"><origin xyz="0.275 0 0"/><parent link="l2"/><child link="l3"/><axis xyz="0 0 1"/>
    <limit lower="-0.2" upper="0.0" velocity="1" effort="100"/></joint>
  <joint name="j4" type="revolute"><origin xyz="0 0 -0.15"/><parent link="l3"/><child link="l4"/><axis xyz="0 0 1"/>
    <limit lower="-3.1" upper="3.1" velocity="6" effort="10"/></joint>
</robot>
"""


@dataclass
class Arm:
    """Numbers of a description: placement and axis of each joint, whether it slides, mass and centre of each link."""

    placements: np.ndarray
    axes: np.ndarray
    slides: np.ndarray
    tip: np.ndarray
    gravity: np.ndarray
    mass: np.ndarray
    first: np.ndarray

    @classmethod
    def of(cls, robot) -> Arm:
        """Takes the numbers of a robot."""
        joints = robot.chain.joints
        return cls(
            placements=np.array([joint.placement for joint in joints]),
            axes=np.array([joint.axis for joint in joints]),
            slides=np.array([joint.kind == "prismatic" for joint in joints]),
            tip=np.asarray(robot.chain.tip),
            gravity=np.asarray(robot.chain.gravity),
            mass=np.nan_to_num(robot.inertia[:, 0]),
            first=np.nan_to_num(robot.inertia[:, 1:4]),
        )

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.axes)


@dataclass
class Errors:
    """Geometric errors of an arm; all zero by default."""

    zero: np.ndarray
    shift: np.ndarray
    turn: np.ndarray
    ratio: np.ndarray
    sine: np.ndarray
    cosine: np.ndarray
    compliance: np.ndarray
    gap: np.ndarray
    approach: np.ndarray | None = field(default=None)

    @classmethod
    def none(cls, n: int) -> Errors:
        """No errors of n joints."""
        one, three = np.zeros(n), np.zeros((n, 3))
        return cls(*(one.copy(), three.copy(), three.copy()), *(one.copy() for _ in range(5)))


def motion(arm: Arm, i: int, value: np.ndarray) -> np.ndarray:
    """What joint i adds (N, 4, 4)."""
    pose = np.tile(np.eye(4), (len(value), 1, 1))
    if arm.slides[i]:
        pose[:, :3, 3] = value[:, None] * arm.axes[i]
    else:
        pose[:, :3, :3] = Rotation.from_rotvec(value[:, None] * arm.axes[i]).as_matrix()
    return pose


def links(arm: Arm, q: np.ndarray, errors: Errors | None = None, torque: np.ndarray | None = None) -> list[np.ndarray]:
    """Poses of all links, with errors: the joint stands shifted and turned, and is off its reading."""
    own = errors or Errors.none(arm.n)
    load = np.zeros_like(q) if torque is None else torque
    pose = np.tile(np.eye(4), (len(q), 1, 1))
    found = []
    for i in range(arm.n):
        off = np.eye(4)
        off[:3, :3] = Rotation.from_rotvec(own.turn[i]).as_matrix()
        off[:3, 3] = own.shift[i]
        value = q[:, i] * (1.0 + own.ratio[i]) + own.zero[i] + own.compliance[i] * load[:, i]
        if not arm.slides[i]:
            value = value + own.sine[i] * np.sin(q[:, i]) + own.cosine[i] * np.cos(q[:, i])
        if own.approach is not None:
            value = value - 0.5 * own.gap[i] * own.approach[:, i]
        pose = pose @ (arm.placements[i] @ off) @ motion(arm, i, value)
        found.append(pose)
    return found


def potential(arm: Arm, q: np.ndarray) -> np.ndarray:
    """Potential energy (N,) [J]."""
    energy = np.zeros(len(q))
    for i, pose in enumerate(links(arm, q)):
        moment = pose[:, :3, :3] @ arm.first[i] + arm.mass[i] * pose[:, :3, 3]
        energy -= moment @ arm.gravity
    return energy


def gravity_torque(arm: Arm, q: np.ndarray, step: float = 1e-5) -> np.ndarray:
    """Torque that gravity exerts at the joints (N, n): minus the derivative of the energy."""
    result = np.empty_like(q)
    for i in range(arm.n):
        move = np.zeros(arm.n)
        move[i] = step
        result[:, i] = -(potential(arm, q + move) - potential(arm, q - move)) / (2.0 * step)
    return result


def flange(arm: Arm, q: np.ndarray, errors: Errors) -> np.ndarray:
    """Pose of the flange with errors (N, 4, 4)."""
    torque = gravity_torque(arm, q) if np.any(errors.compliance) else None
    return links(arm, q, errors, torque)[-1] @ arm.tip


def markers(pose: np.ndarray, tracker: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Positions of markers (N, 3 K) in the tracker's frame."""
    base = np.einsum("nij,kj->nki", pose[:, :3, :3], points) + pose[:, None, :3, 3]
    return (base @ tracker[:3, :3].T + tracker[:3, 3]).reshape(len(pose), -1)


def usual_setup(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """A tracker somewhere, and three markers on the flange."""
    tracker = np.eye(4)
    tracker[:3, :3] = Rotation.from_rotvec(rng.standard_normal(3)).as_matrix()
    tracker[:3, 3] = rng.uniform(-2.0, 2.0, 3)
    points = np.array([[0.06, 0.0, 0.08], [-0.04, 0.06, 0.1], [-0.03, -0.07, 0.12]])
    return tracker, points + 0.01 * rng.standard_normal((3, 3))


def usual_errors(arm: Arm, rng: np.random.Generator) -> Errors:
    """Zeros of 5 mrad, links of 1 mm and 1 mrad, eccentricity of half a mrad, compliance of 2e-5 rad/(N m)."""
    errors = Errors.none(arm.n)
    errors.zero = np.where(arm.slides, 1e-3, 5e-3) * rng.standard_normal(arm.n)
    errors.shift = 1e-3 * rng.standard_normal((arm.n, 3))
    errors.turn = 1e-3 * rng.standard_normal((arm.n, 3))
    errors.sine = np.where(arm.slides, 0.0, 5e-4) * rng.standard_normal(arm.n)
    errors.cosine = np.where(arm.slides, 0.0, 5e-4) * rng.standard_normal(arm.n)
    errors.compliance = np.where(arm.slides, 2e-6, 2e-5) * np.abs(rng.standard_normal(arm.n))
    return errors
