"""Kinematic chains of robots in pinocchio, built joint by joint, independent of the packages under test."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from robots.robot import Robot


def chain_of(robot: Robot) -> tuple[pin.Model, int]:
    """Builds a chain of joints without bodies, and returns it with its last joint's index."""
    model, parent = pin.Model(), 0
    for joint in robot.chain.joints:
        placement = pin.SE3(np.asarray(joint.rotation), np.asarray(joint.translation))
        parent = model.addJoint(parent, pin.JointModelRevoluteUnaligned(np.asarray(joint.axis)), placement, joint.name)
    model.gravity.linear = np.asarray(robot.chain.gravity)
    return model, parent


def torque_of_mass(
    robot: Robot, mass: float, centre: np.ndarray, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray
) -> np.ndarray:
    """Computes the torque (N, n) of a point mass on the flange, at a point in its frame, without other bodies."""
    model, last = chain_of(robot)
    tip = pin.SE3(np.asarray(robot.chain.tip)[:3, :3], np.asarray(robot.chain.tip)[:3, 3])
    model.appendBodyToJoint(last, pin.Inertia(mass, centre, np.zeros((3, 3))), tip)
    data = model.createData()
    return np.array([pin.rnea(model, data, *state) for state in zip(q, dq, ddq, strict=True)])
