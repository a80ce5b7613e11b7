"""The arm behind a controller that is commanded in each cycle: it follows after a fixed time, with a plant's torque."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from oed.controllers.virtual.faults.paths import PathFault
from oed.controllers.virtual.robot import VirtualRobot
from robots.common.arrays import Array


@dataclass(frozen=True, slots=True)
class ArmSample:
    """What the arm does in one cycle.

    Attributes:
        q: positions (n,).
        dq: velocities (n,).
        ddq: accelerations (n,).
        tau: measured torques (n,); None without a plant.
    """

    q: Array
    dq: Array
    ddq: Array
    tau: Array | None


class Arm:
    """Follows the commands of each cycle.

    The position is the command of `lag` before. Velocity and acceleration are its differences, so they agree with it.

    Args:
        pose: where it stands (n,).
        cycle: of the controller [s].
        plant: gives the torque; None without.
        fault: of the path.
    """

    def __init__(self, pose: Array, cycle: float, plant: VirtualRobot | None, fault: PathFault) -> None:
        self._cycle, self._plant, self._fault = cycle, plant, fault
        # The arm follows its commands after about this [s], as servoj does; so long a piece of torque is computed at
        # once.
        self._size = max(round(0.04 / cycle), 2)
        self.command = np.array(pose, dtype=float)
        self.pose = self.command
        self._commands: list[Array] = [self.command] * 2
        self._ahead: deque[ArmSample] = deque([self._rest()] * self._size)
        self._elapsed = self._block = 0
        self._still = 0
        self._last = self._ahead[0]

    @property
    def lag(self) -> float:
        """Time from a command to its position [s]."""
        return (self._size + 1) * self._cycle

    @property
    def speed(self) -> Array:
        """Speed of the last commands (n,) [rad/s]."""
        return (self._commands[-1] - self._commands[-2]) / self._cycle

    def begin(self, clock: float) -> None:
        """Begins a program at a time of the controller's clock [s]."""
        self._elapsed = self._block = 0
        self._fault.begin()
        if self._plant is not None:
            self._plant.begin(clock)

    def tick(self) -> ArmSample:
        """Goes on by one cycle towards the command."""
        elapsed = self._elapsed * self._cycle
        self._elapsed += 1
        if self._fault.holds(elapsed):
            return ArmSample(self._last.q, self._last.dq, self._last.ddq, self._last.tau)
        self._still = self._still + 1 if np.array_equal(self.command, self._commands[-1]) else 0
        self._commands.append(self.command)
        if self._still > 2 * self._size + 2:
            # All is at rest, however long.
            self._commands = [self.command] * 2
            self._ahead = deque([self._rest()] * (self._size + 1))
        elif len(self._commands) == self._size + 2:
            self._compute()
        sample = self._ahead.popleft()
        self._last = replace(sample, q=self._fault.moved(sample.q, elapsed))
        self.pose = self._last.q
        return self._last

    def _compute(self) -> None:
        q = np.array(self._commands)
        dq = (q[2:] - q[:-2]) / (2 * self._cycle)
        ddq = (q[2:] - 2 * q[1:-1] + q[:-2]) / self._cycle**2
        times: Array = self._cycle * (self._block + np.arange(self._size, dtype=np.float64))
        self._block += self._size
        tau = [None] * self._size if self._plant is None else self._plant.follow(times, q[1:-1], dq, ddq)
        seen = q[1:-1] if self._plant is None else self._plant.encoders(q[1:-1])
        self._ahead += [ArmSample(*row) for row in zip(seen, dq, ddq, tau, strict=True)]
        self._commands = self._commands[-2:]

    def _rest(self) -> ArmSample:
        zero = np.zeros_like(self.command)
        tau = self._plant.stand(self.command) if self._plant is not None else None
        return ArmSample(self.command, zero, zero, tau)
