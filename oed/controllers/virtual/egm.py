"""An ABB controller to test against whose motion is guided: it sends its state in each cycle, and takes the answers."""

from __future__ import annotations

import select
import socket
import time
from contextlib import suppress

import numpy as np

from oed.controllers.egm.messages import (
    GUIDING_RUNNING,
    GUIDING_STOPPED,
    MOTORS_OFF,
    MOTORS_ON,
    guided_axes,
    robot_message,
)
from oed.controllers.virtual.arm import Arm
from oed.controllers.virtual.faults.paths import PathFault
from oed.controllers.virtual.service import Service
from oed.controllers.virtual_options import ControllerOptions
from oed.exports.forms.base import require_joints
from oed.exports.simple_message import MessageError
from robots.common.arrays import Array
from robots.joints.controller_axes import axes_of, joints_of
from robots.robot import Robot

EGM_CYCLE = 0.004
"""Cycle of the controller [s]."""


class VirtualEgm(Service):
    """Behaves as an ABB controller that runs the module of `oed export --to abb-egm`, on this computer.

    Args:
        robot: what it controls.
        options: ports, state, speed and faults; 0 as state port is any free one.
        pose: where the robot stands (n,) [rad]; its home by default.

    Raises:
        InputError: a robot with another number of joints, or with linear axes.
    """

    def __init__(self, robot: Robot, *, options: ControllerOptions, pose: Array | None = None) -> None:
        super().__init__()
        require_joints(robot, 1, 6, "a guided ABB arm")
        self.options, self._axes, self._n = options, robot.axes, robot.n
        start = np.asarray(robot.limits.home if pose is None else pose, dtype=float)
        fault = PathFault(options.faults.path, options.faults.path_after)
        self._arm = Arm(start, EGM_CYCLE, None, fault)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind((options.host, 0))
        self._socket.setblocking(False)
        self.state_port = options.state_port or _free_port(options.host)
        """Where the state goes to."""
        self._ticks = self.points = self.malformed = self.played = self.error = 0
        self.stalled = 0.0
        self._due_from = time.monotonic()
        self._motors = MOTORS_OFF if options.state in ("drives-off", "e-stop") else MOTORS_ON
        self._guided = (
            GUIDING_STOPPED if options.state in ("error", "manual") or options.faults.stuck else GUIDING_RUNNING
        )
        self._silent = False

    @property
    def motion_port(self) -> int:
        """There is one port."""
        return self.state_port

    @property
    def time(self) -> float:
        """Its clock [s]."""
        return self._ticks * EGM_CYCLE

    @property
    def lag(self) -> float:
        """How long the arm follows behind its commands [s]."""
        return self._arm.lag

    @property
    def moving(self) -> bool:
        """Whether the command changes."""
        return bool(np.abs(self._arm.speed).max() > 0)

    def _close(self) -> None:
        self._socket.close()

    def _turn(self) -> None:
        wait = self._due_from + EGM_CYCLE / self.options.speed - time.monotonic()
        if select.select([self._socket], [], [], min(max(wait, 0.0005), 0.02))[0]:
            with suppress(OSError):
                self._take(self._socket.recvfrom(4096)[0])
        now, step = time.monotonic(), EGM_CYCLE / self.options.speed
        # A delay of this program beyond this [s] is no time of the controller.
        if now - self._due_from > 0.15:
            self.stalled += now - self._due_from
            self._due_from = now - step
        for _ in range(int((now - self._due_from) / step + 1e-9)):
            self._due_from += step
            sample = self._arm.tick()
            axes = axes_of(self._axes, sample.q).tolist()
            if not self._silent:
                data = robot_message(self._ticks, self.time, axes, self._motors, self._guided)
                with suppress(OSError):
                    self._socket.sendto(data, (self.options.host, self.state_port))
            self._ticks += 1

    def _take(self, data: bytes) -> None:
        try:
            axes = guided_axes(data)
        except MessageError:
            self.malformed += 1
            return
        if self._motors == MOTORS_ON and self._guided == GUIDING_RUNNING:
            self._count()
            if self.points == 1:
                self._arm.begin(self.time)
            self._arm.command = joints_of(self._axes, axes)[: self._n]

    def _count(self) -> None:
        self.points += 1
        faults, count = self.options.faults, self.points
        if faults.silent_after is not None and count > faults.silent_after:
            self._silent = True
        if faults.error_after is not None and count > faults.error_after:
            self._guided = GUIDING_STOPPED
        if faults.e_stop_after is not None and count > faults.e_stop_after:
            self._motors = MOTORS_OFF
        if faults.restart_after is not None and count > faults.restart_after and self._ticks > 500:
            self._ticks = 0


def _free_port(host: str) -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind((host, 0))
        return int(probe.getsockname()[1])
