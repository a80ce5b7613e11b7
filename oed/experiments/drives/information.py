"""What a motion tells of drives: simulated positions, loads, and the Fisher information of the parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robots.common.arrays import Array
from robots.drives import Drive, DriveDynamics, HeldCommand, Start, simulate_drives
from robots.robot import Robot


@dataclass(frozen=True, kw_only=True)
class Sought:
    """A parameter that the motion is to determine.

    Attributes:
        parameter: its name.
        joints: those that share it, counted from 0 over all chains.
        group: a name for people.
        unit: its unit.
        size: a usual size.
    """

    parameter: str
    joints: tuple[int, ...]
    group: str
    unit: str
    size: float


class Loop:
    """Chains with their drives, and the parameters that are sought.

    Args:
        robots: the chains.
        drives: of all joints.
        names: parameters per joint that are sought, beside a delay of all joints.
    """

    def __init__(self, robots: Sequence[Robot], drives: Sequence[Drive], names: Sequence[str]) -> None:
        self.robots = tuple(robots)
        ends = np.cumsum([robot.n for robot in robots])
        self.columns = [np.arange(end - robot.n, end) for robot, end in zip(robots, ends, strict=True)]
        self.dynamics = [
            DriveDynamics(robot, [drives[j] for j in columns])
            for robot, columns in zip(robots, self.columns, strict=True)
        ]
        self.drives = tuple(drives)
        joint_names = [name for robot in robots for name in robot.joint_names]
        self.names = tuple(joint_names)
        self.sought = [self._sought("delay", tuple(range(len(drives))), "all")]
        self.sought += [self._sought(name, (j,), joint_names[j]) for name in names for j in range(len(drives))]
        self.directions = [self._directions(chain) for chain in range(len(robots))]

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.drives)

    def _sought(self, name: str, joints: tuple[int, ...], group: str) -> Sought:
        drive = self.drives[joints[0]]
        described = drive.parameters[drive.names.index(name)]
        return Sought(parameter=name, joints=joints, group=group, unit=described.unit, size=described.size)

    def _directions(self, chain: int) -> Array:
        layout = self.dynamics[chain].layout
        matrix = np.zeros((self.dynamics[chain].size, len(self.sought)))
        for k, item in enumerate(self.sought):
            for joint in item.joints:
                if joint in self.columns[chain]:
                    matrix[layout.place(joint - int(self.columns[chain][0]), item.parameter), k] = item.size
        return matrix

    def played(self, t: Array, command: Array, noise: Array) -> tuple[Array, Array, Array]:
        """Simulates a command from rest at its start.

        Args:
            t: times (N,) [s].
            command: (N, n) [rad or m].
            noise: standard deviation of each joint's position (n,) [rad or m].

        Returns:
            Positions and velocities (N, n), and the information of the scaled parameters (K, K).

        Raises:
            SolverError: a loop that is not stable.
        """
        q, dq = np.empty_like(command), np.empty_like(command)
        total = np.zeros((len(self.sought), len(self.sought)))
        for chain, columns in enumerate(self.columns):
            used = np.flatnonzero(self.directions[chain].any(axis=0))
            found = simulate_drives(
                self.dynamics[chain],
                HeldCommand(t, command[:, columns]),
                t,
                Start(command[0, columns], np.zeros(len(columns))),
                self.dynamics[chain].values,
                directions=self.directions[chain][:, used],
            )
            q[:, columns], dq[:, columns] = found.measured, found.dq
            assert found.sensitivity is not None
            J = (found.sensitivity / noise[columns][:, None]).reshape(-1, len(used))
            total[np.ix_(used, used)] += J.T @ J
        return q, dq, total


def expected_errors(information: Array, sizes: Array, prior: float = 100.0) -> Array:
    """Gives standard errors (K,) in the parameters' units; `prior` sizes where a motion shows nothing."""
    inverse = np.linalg.inv(information + np.eye(len(information)) / prior**2)
    return np.asarray(np.sqrt(np.diag(inverse)) * sizes)
