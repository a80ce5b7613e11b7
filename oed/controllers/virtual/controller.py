"""The controller to test against: one loop over two ports, a player, and the faults that were ordered."""

from __future__ import annotations

import select
import time
from functools import partial

import numpy as np

from oed.controllers.virtual.faults.network import Network
from oed.controllers.virtual.fixed_packets import FixedPackets
from oed.controllers.virtual.messages import feedback_frame, reply_frame, status_frame
from oed.controllers.virtual.motoman import MotomanProgram
from oed.controllers.virtual.player import Fault, Outcome, Player
from oed.controllers.virtual.ports import Client, Port, TcpPort, UdpPort
from oed.controllers.virtual.robot import VirtualRobot
from oed.controllers.virtual.service import Service
from oed.controllers.virtual_options import ControllerOptions
from oed.exports.simple_message import (
    Bare,
    Comm,
    Frame,
    FullPoint,
    Kind,
    MessageError,
    Ping,
    Point,
    Reply,
    Special,
    Splitter,
    Valid,
)
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.plants import Plant, nominal_plant
from robots.robot import Robot

NEEDED = Valid.TIME | Valid.POSITION
"""What a point must state."""


class VirtualController(Service):
    """Behaves as the thesis' program for the controller does, on this computer.

    Args:
        robot: what it controls.
        plant: how that robot really behaves; its description by default. Needed for feedback with torque only.
        options: ports, buffer, feedback and faults.
        pose: where the robot stands (n,) [rad or m]; its home by default.
        seed: of the sensors' noise.

    Raises:
        InputError: a pose of another size, a robot without nominal dynamics and without plant, or a taken port.
    """

    def __init__(
        self,
        robot: Robot,
        plant: Plant | None = None,
        *,
        options: ControllerOptions | None = None,
        pose: Array | None = None,
        seed: int = 0,
    ) -> None:
        self.options = options or ControllerOptions()
        pose = np.asarray(robot.limits.home if pose is None else pose, dtype=float)
        if pose.shape != (robot.n,):
            raise InputError(f"a pose of {pose.size} values", allowed=f"{robot.n}, as {robot.name} has joints")
        virtual = None
        if self.options.feedback == "torque":
            virtual = VirtualRobot(plant or nominal_plant(robot), self.options.feedback_period, seed)
        self._virtual = virtual
        driver = self.options.driver
        self._fixed = FixedPackets if driver is not None and driver.fixed_packets else None
        self._motion, self._state = open_ports(self.options)
        self._network = Network(self.options.faults)
        self._start_over(pose)
        super().__init__()
        self.received = self.malformed = self.refused = self.restarts = self.points = 0
        self.stalled = 0.0

    def _start_over(self, pose: Array) -> None:
        self._player = Player(pose, self._virtual, self.options)
        self._commands = MotomanProgram()
        self._external = self.options.external
        self._waiting: dict[tuple[Client, int], Frame] = {}
        self._clock_ticks = self._sent = 0
        self._due_from = time.monotonic()
        self._silent = False
        self._state_now = self.options.state
        self._status_due = 0.0

    @property
    def motion_port(self) -> int:
        """The port that takes points."""
        return self._motion.number

    @property
    def state_port(self) -> int:
        """The port that gives feedback."""
        return self._state.number

    @property
    def player(self) -> Player:
        """What it is playing."""
        return self._player

    @property
    def played(self) -> int:
        """Trajectories that were played to their end."""
        return self._player.played_trajectories

    @property
    def moving(self) -> bool:
        """Whether a trajectory is played."""
        return self._player.moving

    @property
    def error(self) -> int:
        """The error that it reports; 0 for none."""
        return self._player.error

    @property
    def time(self) -> float:
        """Its clock, which feedback carries [s]."""
        return self._clock_ticks * self.options.feedback_period

    def _close(self) -> None:
        self._motion.close()
        self._state.close()

    def _turn(self) -> None:
        now = time.monotonic()
        wait = min(0.02, self._due_from + self.options.feedback_period / self.options.speed - now)
        wait = min(wait, self._network.next - now)
        ports = {sock: port for port in (self._motion, self._state) for sock in port.sockets()}
        for sock in select.select(list(ports), [], [], max(wait, 0.0005))[0]:
            port = ports[sock]
            for client, data in port.receive(sock, time.monotonic()):
                self._network.send(time.monotonic(), partial(self._deliver, port, client, data))
        now = time.monotonic()
        self._network.deliver(now)
        self._advance(now)

    def _send(self, port: Port, client: Client, data: bytes) -> None:
        if not self._silent:
            self._network.send(time.monotonic(), lambda: port.send(client, data))

    def _deliver(self, port: Port, client: Client, data: bytes) -> None:
        self.received += 1
        known = client in port.clients
        answer = port.admit(client, data, time.monotonic())
        if answer is not None:
            if port is self._motion and not known:
                self._player.clear_error()
            self._send(port, client, answer)
            return
        if client not in port.clients or len(data) == 1:
            return
        try:
            if port is self._motion and self._fixed is not None:
                frame = self._fixed(self.options.form).point(data)
            else:
                frame = self.options.form.decode(data)
        except MessageError:
            self.malformed += 1
            return
        if port is self._motion:
            self._handle(client, frame)
        elif isinstance(frame.message, Ping) and frame.comm == Comm.REQUEST:
            self._send(port, client, self.options.form.encode(reply_frame(frame, Reply.SUCCESS, self.options)))

    def _handle(self, client: Client, frame: Frame) -> None:
        message, driver = frame.message, self.options.driver
        if driver is not None and driver.pings == "end" and not isinstance(message, Point):
            self.refused += 1
            self._motion.drop(client)
            return
        if driver is not None and driver.commands and not isinstance(message, Ping):
            before = self._player.accepted
            reply = self._commands.answer(message, self._player, self._state_now == "ready")
            self._send(self._motion, client, self.options.form.encode(reply))
            self._count(self._player.accepted - before)
            return
        if isinstance(message, Ping):
            self._answer(client, frame, Reply.SUCCESS)
            return
        if not isinstance(message, FullPoint | Point):
            self.refused += 1
            self._answer(client, frame, Reply.FAILURE)
            return
        if message.sequence == Special.STOP:
            self._waiting.clear()
            self._player.stop()
            self._answer(client, frame, Reply.SUCCESS)
            self._motion.release(client)
            return
        if message.sequence == Special.START_STREAMING:
            self._answer(client, frame, Reply.SUCCESS)
            return
        if self._state_now != "ready":
            self._answer(client, frame, Reply.FAILURE)
            return
        if isinstance(message, FullPoint) and message.valid & NEEDED != NEEDED:
            self._answer(client, frame, Reply.FAILURE)
            return
        if self._external:
            n = len(self._player.pose)
            self._external = message.positions[n : n + len(self._external)]
        outcome = self._player.put(message, time.monotonic(), streaming=frame.comm == Comm.REQUEST)
        if outcome == Outcome.FULL:
            # Requests that wait for room in the buffer, at most.
            if len(self._waiting) < 256:
                self._waiting[client, message.sequence] = frame
            return
        self._count(int(outcome == Outcome.ACCEPTED))
        self._answer(client, frame, Reply.FAILURE if outcome is None else Reply.SUCCESS)

    def _answer(self, client: Client, frame: Frame, code: Reply) -> None:
        if frame.comm == Comm.REQUEST:
            self._send(self._motion, client, self.options.form.encode(reply_frame(frame, code, self.options)))

    def _count(self, points: int) -> None:
        if points:
            self.points += points
            self._break_as_ordered()

    def _break_as_ordered(self) -> None:
        """Has the faults that come after a number of points."""
        faults, count = self.options.faults, self.points
        if faults.silent_after is not None and count > faults.silent_after:
            self._silent = True
        if faults.error_after is not None and count > faults.error_after:
            self._player.fail(Fault.REPORTED)
        if faults.e_stop_after is not None and count > faults.e_stop_after and self._state_now == "ready":
            self._player.stop()
            self._state_now = "e-stop"
        if faults.restart_after is not None and count > faults.restart_after and not self.restarts:
            self.restarts += 1
            self._motion.forget()
            self._state.forget()
            self._network.clear()
            self._start_over(self._player.pose)

    def _advance(self, now: float) -> None:
        """Goes on with the controller's time, and sends what is due."""
        step = self.options.feedback_period / self.options.speed
        # A delay of this program beyond this [s] is no time of the controller: its clock stands still for so long.
        if now - self._due_from > max(0.15, 2 * step):
            self.stalled += now - self._due_from
            self._due_from = now - step
        due = int((now - self._due_from) / step + 1e-9)
        for _ in range(due):
            clock = self.time
            sample = self._player.tick(clock, now, bool(self._state.clients))
            if sample is None:
                self._due_from = now
                break
            self._due_from += step
            self._clock_ticks += 1
            if self._state.clients and self._clock_ticks % self.options.feedback_every == 0:
                self._sent += 1
                feedback = feedback_frame(sample, clock, self._sent, self.options.feedback, self._external)
                data = self.options.form.encode(feedback)
                for client in list(self._state.clients):
                    self._send(self._state, client, data)
                if self.options.status and clock >= self._status_due:
                    self._status_due = clock + 0.1
                    data = self.options.form.encode(status_frame(self._player, self._state_now))
                    for client in list(self._state.clients):
                        self._send(self._state, client, data)
        if self._waiting:
            waiting, self._waiting = self._waiting, {}
            for (client, _), frame in waiting.items():
                self._handle(client, frame)


def open_ports(options: ControllerOptions) -> tuple[Port, Port]:
    """Opens the motion port and the state port.

    Raises:
        InputError: a taken port, or an address of another computer.
    """
    o, driver = options, options.driver
    once = driver is not None and driver.one_handshake
    cut = FixedPackets if driver is not None and driver.fixed_packets else Splitter
    if o.transport == "tcp":
        motion: Port = TcpPort(o.host, o.motion_port, lambda: cut(o.form), 1)
    else:
        # The thesis' program stores the point again that it holds, and replies.
        stale = o.form.encode(Frame(Bare(kind=Kind.JOINT_TRAJ_PT_FULL), Comm.REPLY, Reply.SUCCESS)) if once else None
        motion = UdpPort(o.host, o.motion_port, o.handshake, 1, once, stale)
    # Clients of the state port.
    recorders = 16
    try:
        if o.transport == "tcp":
            return motion, TcpPort(o.host, o.state_port, lambda: Splitter(o.form), recorders)
        return motion, UdpPort(o.host, o.state_port, o.handshake, 1 if once else recorders, once, None)
    except BaseException:
        motion.close()
        raise
