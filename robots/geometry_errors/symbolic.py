"""The Jacobian of a nominal arm as an expression in its positions: designs of poses have exact derivatives by it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi
import numpy as np
from numpy.typing import NDArray

from robots.common.arrays import Array
from robots.geometry.symbolic import cleaned, symbolic_placement
from robots.geometry_errors.measurements import Measurement, Setup
from robots.geometry_errors.measurements.base import Scene
from robots.geometry_errors.measurements.setup import tangents
from robots.geometry_errors.state import ArmState
from robots.geometry_errors.terms import ErrorTerm
from robots.robot import Robot


class SymbolicArm:
    """A nominal arm over symbols of its positions.

    Args:
        robot: the robot.

    Attributes:
        q: (n,) symbols [rad or m].
        flange: pose of the flange in the base frame (4, 4).
    """

    def __init__(self, robot: Robot) -> None:
        self.robot, self.q = robot, casadi.SX.sym("q", robot.n)
        self._joint_frames: list[casadi.SX] = []
        self._links: list[casadi.SX] = []
        pose = casadi.SX.eye(4)
        for i, joint in enumerate(robot.chain.joints):
            self._joint_frames.append(pose @ _pose(casadi.SX(cleaned(joint.rotation)), casadi.SX(joint.translation)))
            pose = pose @ _pose(*symbolic_placement(joint, self.q[i]))
            self._links.append(pose)
        self.flange = pose @ casadi.SX(cleaned(np.asarray(robot.chain.tip)))

    def state(self) -> ArmState:
        """One pose, whose numbers are expressions."""
        load = self._loads() if self.robot.has_masses else None
        return ArmState(q=_elements(self.q.T), load=load)

    def columns(self, terms: Sequence[ErrorTerm]) -> casadi.SX:
        """Writes the twist of the flange, in its axes, by each parameter of some kinds (6, P)."""
        state, found = self.state(), []
        for term in terms:
            for column in term.columns(self.robot, state):
                twist = casadi.SX(6, 1)
                for joint, own in column.twists:
                    twist += self._at_flange(joint, casadi.vertcat(*own[0].tolist()))
                found.append(twist)
        return casadi.horzcat(*found) if found else casadi.SX(6, 0)

    def _at_flange(self, joint: int, twist: casadi.SX) -> casadi.SX:
        frame, flange = self._joint_frames[joint], self.flange
        shift, turn = frame[:3, :3] @ twist[:3], frame[:3, :3] @ twist[3:]
        arm = flange[:3, 3] - frame[:3, 3]
        return casadi.vertcat(flange[:3, :3].T @ (shift + casadi.cross(turn, arm)), flange[:3, :3].T @ turn)

    def _loads(self) -> NDArray[Any]:
        """Force and moment of gravity about each joint in the axes of its frame (1, n, 6), as `gravity_loads`."""
        known, gravity = np.asarray(self.robot.inertia), casadi.SX(np.asarray(self.robot.chain.gravity))
        mass, moment, rows = 0.0, casadi.SX(3, 1), []
        for i in reversed(range(self.robot.n)):
            link, frame = self._links[i], self._joint_frames[i]
            mass += known[i, 0]
            moment += link[:3, :3] @ casadi.SX(known[i, 1:4]) + known[i, 0] * link[:3, 3]
            about = casadi.cross(moment - mass * frame[:3, 3], gravity)
            rows.append(casadi.vertcat(frame[:3, :3].T @ (mass * gravity), frame[:3, :3].T @ about))
        return _elements(casadi.horzcat(*rows[::-1]).T)[None]


def symbolic_jacobian(
    robot: Robot, terms: Sequence[ErrorTerm], measurement: Measurement, setup: Setup
) -> casadi.Function:
    """Writes the derivative of what is measured by all errors, then by the setup, where all errors are zero.

    Args:
        robot: the robot.
        terms: kinds of errors that depend on the pose alone.
        measurement: what is measured.
        setup: where instruments and markers are.

    Returns:
        q (n,) -> (r, P + K).
    """
    arm = SymbolicArm(robot)
    step, parts = casadi.SX.sym("twist", 6), {}
    steps: list[casadi.SX] = []
    for name, part in setup.items():
        own = casadi.SX.sym(name, 0 if part.known else part.size)
        steps.append(own)
        parts[name] = casadi.SX(part.value) if part.known else _moved(part.kind, part.value, own)
    nominal: Scene = (arm.flange, {name: casadi.SX(part.value) for name, part in setup.items()})
    seen = measurement.expression((arm.flange @ _small(step), parts), nominal)
    moves = casadi.vertcat(step, *steps)
    whole = casadi.substitute(casadi.jacobian(seen, moves), moves, casadi.SX.zeros(moves.numel()))
    rows = casadi.horzcat(whole[:, :6] @ arm.columns(terms), whole[:, 6:])
    return casadi.Function("rows", [arm.q], [casadi.densify(rows)], ["q"], ["jacobian"])


def _elements(matrix: casadi.SX) -> NDArray[Any]:
    """Expressions as objects, with which numpy calculates as with numbers."""
    rows, columns = matrix.shape
    return np.array([[matrix[i, j] for j in range(columns)] for i in range(rows)], dtype=object)


def _pose(rotation: casadi.SX, translation: casadi.SX) -> casadi.SX:
    return casadi.vertcat(casadi.horzcat(rotation, translation), casadi.SX([[0.0, 0.0, 0.0, 1.0]]))


def _small(twist: casadi.SX) -> casadi.SX:
    """A pose that is right to first order in its twist."""
    return _pose(casadi.SX.eye(3) + casadi.skew(twist[3:]), twist[:3])


def _moved(kind: str, value: Array, step: casadi.SX) -> casadi.SX:
    """A part of the setup after a small step of its parameters, as `Unknown.moved`."""
    if kind == "pose":
        return casadi.SX(value) @ _small(step)
    if kind == "rotation":
        return casadi.SX(value) @ (casadi.SX.eye(3) + casadi.skew(step))
    if kind == "direction":
        return casadi.SX(value) + casadi.SX(tangents(value)) @ step
    return casadi.SX(value) + step
