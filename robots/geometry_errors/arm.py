"""An arm with geometric errors: where its flange is, and how each parameter moves it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from robots.common.arrays import Array
from robots.geometry.chain import Chain, Joint, joint_motion
from robots.geometry_errors.state import ArmState
from robots.geometry_errors.terms import Column, ErrorTerm
from robots.geometry_errors.twists import adjoint, exponential, inverse, right_jacobian
from robots.robot import Robot


@dataclass(frozen=True, kw_only=True, eq=False)
class ErroneousArm:
    """A robot with kinds of geometric errors: ``T = prod P_i exp(a_i) exp(b_i) J_i(q_i) tip``.

    ``a_i`` are errors of the link that carries joint i, ``b_i`` is the sum of all others.

    Attributes:
        robot: its nominal description.
        terms: the kinds.
    """

    robot: Robot
    terms: tuple[ErrorTerm, ...]

    def columns(self, state: ArmState) -> ArmColumns:
        """Prepares the columns of all parameters at some poses."""
        found = [(column, term.of_link) for term in self.terms for column in term.columns(self.robot, state)]
        return ArmColumns(self.robot, state, [column for column, _ in found], [of_link for _, of_link in found])

    def corrected_chain(self, values: Mapping[str, float]) -> Chain:
        """Gives the chain with the constant errors in its placements.

        Args:
            values: of parameters by name; those that are not named are zero.
        """
        state = ArmState(q=np.zeros((1, self.robot.n)))
        twists = np.zeros((2, self.robot.n, 6))
        for term in (term for term in self.terms if term.constant):
            for column in term.columns(self.robot, state):
                for number, twist in column.twists:
                    twists[0 if term.of_link else 1, number] += values.get(column.parameter.name, 0.0) * twist[0]
        joints = []
        for joint, first, second in zip(self.robot.chain.joints, *twists, strict=True):
            placement = joint.placement @ exponential(first) @ exponential(second)
            # Rounding of long products must not add up.
            left, _, right = np.linalg.svd(placement[:3, :3])
            joints.append(Joint(joint.name, joint.kind, left @ right, placement[:3, 3], joint.axis))
        return Chain(tuple(joints), self.robot.chain.gravity, self.robot.chain.tip)


class ArmColumns:
    """The columns of an arm's parameters at N poses, and its flange for any values of them.

    Args:
        robot: the robot.
        state: the poses.
        columns: of the parameters.
        of_link: whether each is of a link, and the same at all poses.
    """

    def __init__(self, robot: Robot, state: ArmState, columns: Sequence[Column], of_link: Sequence[bool]) -> None:
        self.robot, self.state, self.count = robot, state, len(columns)
        self.parameters = tuple(column.parameter for column in columns)
        n = robot.n
        # Per joint: the numbers of the parameters that move it, and their twists (6, K) or (N, 6, K).
        self._fixed: list[tuple[list[int], Array]] = []
        self._varying: list[tuple[list[int], Array]] = []
        for i in range(n):
            for store, wanted in ((self._fixed, True), (self._varying, False)):
                rows = [
                    (k, twist)
                    for k, (column, fixed) in enumerate(zip(columns, of_link, strict=True))
                    for joint, twist in column.twists
                    if joint == i and fixed == wanted
                ]
                shape = (1 if wanted else state.rows, 6, len(rows))
                twists = (
                    np.stack([np.broadcast_to(t, shape[:2]) for _, t in rows], axis=-1) if rows else np.zeros(shape)
                )
                store.append(([k for k, _ in rows], twists))
        self._motions = np.stack(
            [joint_motion(joint.kind, joint.axis, state.q[:, i]) for i, joint in enumerate(robot.chain.joints)], axis=1
        )

    def flange(self, values: Array) -> Array:
        """Pose of the flange in the base frame (N, 4, 4)."""
        return self._walk(values)[0]

    def jacobian(self, values: Array) -> tuple[Array, Array]:
        """Pose of the flange, and its twist per parameter.

        Args:
            values: of the parameters (P,).

        Returns:
            (N, 4, 4), and (N, 6, P) in the axes of the flange.
        """
        flange, after_fixed, after_varying, fixed, varying = self._walk(values)
        rows, back = self.state.rows, inverse(flange)
        result = np.zeros((rows, 6, self.count))
        for i in range(self.robot.n):
            for (numbers, twists), frames, value in (
                (self._fixed[i], after_fixed[i], fixed[i]),
                (self._varying[i], after_varying[i], varying[i]),
            ):
                if numbers:
                    moved = right_jacobian(value) @ twists if np.any(value) else twists
                    carried = adjoint(back @ frames)
                    # One product of matrices is much faster than one for each pose.
                    own = (
                        (carried.reshape(-1, 6) @ moved[0]).reshape(rows, 6, -1) if len(moved) == 1 else carried @ moved
                    )
                    # A parameter may move several joints.
                    result[:, :, numbers] += own
        return flange, result

    def _walk(self, values: Array) -> tuple[Array, list[Array], list[Array], list[Array], list[Array]]:
        pose = np.tile(np.eye(4), (self.state.rows, 1, 1))
        after_fixed, after_varying, fixed, varying = [], [], [], []
        for i, joint in enumerate(self.robot.chain.joints):
            numbers, twists = self._fixed[i]
            fixed.append((twists @ values[numbers])[0])
            pose = pose @ (joint.placement @ exponential(fixed[i]))
            after_fixed.append(pose)
            numbers, twists = self._varying[i]
            varying.append(twists @ values[numbers])
            if numbers:
                pose = pose @ exponential(varying[i])
            after_varying.append(pose)
            pose = pose @ self._motions[:, i]
        return pose @ self.robot.chain.tip, after_fixed, after_varying, fixed, varying
