"""A UR controller to test against: RTDE at its state port, programs at its motion port."""

from __future__ import annotations

import select
import socket
import struct
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from math import nan
from typing import Any

import numpy as np

from oed.controllers.rtde.packages import (
    AS_TORQUE,
    FIELDS,
    NOT_FOUND,
    PLAYED,
    UR_JOINTS,
    Command,
    Packages,
    body_format,
    opened,
    package,
)
from oed.controllers.rtde.state import PROGRAM_PLAYING, PROGRAM_STOPPED, ROBOT_RUNNING, Safety
from oed.controllers.virtual.arm import Arm, ArmSample
from oed.controllers.virtual.faults.paths import PathFault
from oed.controllers.virtual.ports import Client, TcpPort
from oed.controllers.virtual.robot import VirtualRobot
from oed.controllers.virtual.service import Service
from oed.controllers.virtual.ur.script import Halt, Run, ScriptError, program_of, run_program
from oed.controllers.virtual_options import ControllerOptions
from oed.exports.forms.base import require_joints
from oed.exports.forms.urscript import CYCLES
from robots.common.arrays import Array
from robots.plants import Plant, nominal_plant
from robots.robot import Robot


class _Programs:
    """Cuts what the port for programs gets into whole programs."""

    def __init__(self) -> None:
        self._held = ""

    def feed(self, data: bytes) -> list[bytes]:
        self._held += data.decode("ascii", "replace")
        *whole, self._held = self._held.split("\nend\n")
        return [f"{text}\nend\n".encode() for text in whole]


class VirtualUr(Service):
    """Behaves as a UR controller does, on this computer.

    A robot with a period of 8 ms gets a CB controller, others one of the e-series, which also reports currents as
    torques.

    Args:
        robot: what it controls.
        plant: how that robot really behaves; its description by default.
        options: ports, state, speed and faults; the ones of datagrams have no meaning here.
        pose: where the robot stands (n,) [rad]; its home by default.
        seed: of the sensors' noise.

    Raises:
        InputError: a robot without six joints or without nominal dynamics and plant, or a taken port.
    """

    def __init__(
        self,
        robot: Robot,
        plant: Plant | None = None,
        *,
        options: ControllerOptions,
        pose: Array | None = None,
        seed: int = 0,
    ) -> None:
        super().__init__()
        require_joints(robot, UR_JOINTS, UR_JOINTS, "a UR controller")
        self.options = options
        self.cycle = robot.period if robot.period in CYCLES else min(CYCLES)
        plant = plant or nominal_plant(robot)
        self._model, self._parameters = plant.model, plant.parameters
        virtual = VirtualRobot(plant, self.cycle, seed)
        fault = PathFault(options.faults.path, options.faults.path_after)
        start = np.asarray(robot.limits.home if pose is None else pose, dtype=float)
        self._arm = Arm(start, self.cycle, virtual, fault)
        clients = 16
        self._scripts = TcpPort(options.host, options.motion_port, _Programs, clients)
        try:
            self._state = TcpPort(options.host, options.state_port, Packages, clients)
        except BaseException:
            self._scripts.close()
            raise
        self._recipes: dict[Client, list[str]] = {}
        self._sending: set[Client] = set()
        self._ticks = 0
        self._due_from = self._said = time.monotonic()
        self._registers: dict[int, int] = {}
        self._run: Run | None = None
        self._wire: socket.socket | None = None
        self._data = b""
        self._starved: float | None = None
        self._safety = {"e-stop": Safety.ROBOT_EMERGENCY_STOP, "error": Safety.PROTECTIVE_STOP}.get(
            options.state, Safety.NORMAL
        )
        self._silent = False
        self.points = self.malformed = self.programs = self.restarts = 0
        self.stalled = 0.0
        self.said: list[str] = []
        """What programs have shown on the display."""

    @property
    def motion_port(self) -> int:
        """The port that takes programs."""
        return self._scripts.number

    @property
    def state_port(self) -> int:
        """The port of RTDE."""
        return self._state.number

    @property
    def time(self) -> float:
        """Its clock [s]."""
        return self._ticks * self.cycle

    @property
    def lag(self) -> float:
        """How long the arm follows behind its commands [s]."""
        return self._arm.lag

    @property
    def moving(self) -> bool:
        """Whether a program runs."""
        return self._run is not None

    @property
    def played(self) -> int:
        """Programs that ended by themselves."""
        return self.programs

    @property
    def error(self) -> int:
        """The safety mode that keeps it from moving; 0 for none."""
        return 0 if self._safety == Safety.NORMAL else int(self._safety)

    def _close(self) -> None:
        self._end_program()
        self._scripts.close()
        self._state.close()

    def _turn(self) -> None:
        wait = self._due_from + self.cycle / self.options.speed - time.monotonic()
        ports = {sock: port for port in (self._scripts, self._state) for sock in port.sockets()}
        for sock in select.select(list(ports), [], [], max(min(wait, 0.02), 0.0005))[0]:
            port = ports[sock]
            for client, data in port.receive(sock, time.monotonic()):
                (self._answer if port is self._state else self._load)(client, data)
        self._advance(time.monotonic())

    def _answer(self, client: Client, data: bytes) -> None:
        """Answers a request of RTDE."""
        kind, body = opened(data)
        if kind == Command.VERSION:
            reply = struct.pack(">B", struct.unpack(">H", body)[0] == 2)
        elif kind == Command.CONTROLLER_VERSION:
            reply = struct.pack(">4I", *((3, 15, 8, 0) if CYCLES[self.cycle] == "CB" else (5, 23, 0, 0)))
        elif kind == Command.OUTPUTS:
            names = body[8:].decode("ascii", "replace").split(",")
            self._recipes[client] = names
            reply = b"\1" + ",".join(self._type(name) for name in names).encode()
        elif kind == Command.START:
            known = client in self._recipes and NOT_FOUND not in map(self._type, self._recipes[client])
            reply = struct.pack(">B", known)
            if known:
                self._sending.add(client)
        else:
            self.malformed += 1
            return
        self._say(self._state, client, package(Command(kind), reply))

    def _type(self, name: str) -> str:
        if name == AS_TORQUE:
            return NOT_FOUND if CYCLES[self.cycle] == "CB" else FIELDS["actual_q"]
        return FIELDS.get(name, NOT_FOUND)

    def _say(self, port: TcpPort, client: Client, data: bytes) -> None:
        if not self._silent:
            port.send(client, data)

    def _load(self, client: Client, data: bytes) -> None:
        """Takes a program; it replaces one that runs. A controller that is not ready, or is stuck, ignores it."""
        try:
            run = run_program(program_of(data.decode("ascii", "replace")), self._commands())
        except ScriptError as error:
            self.malformed += 1
            self.said.append(str(error))
            return
        if self.options.state != "ready" or self.error or self.options.faults.stuck:
            return
        self._end_program()
        self._run = run
        self._arm.begin(self.time)

    def _end_program(self) -> None:
        self._run = None
        if self._wire is not None:
            self._wire.close()
            self._wire, self._data = None, b""

    def _advance(self, now: float) -> None:
        """Goes on with the controller's time, and sends what is due."""
        step = self.cycle / self.options.speed
        # A delay of this program beyond this [s] is no time of the controller: its clock stands still for so long.
        if now - self._due_from > max(0.15, 2 * step):
            self.stalled += now - self._due_from
            self._due_from = now - step
        for _ in range(int((now - self._due_from) / step + 1e-9)):
            self._starved = None
            try:
                if self._run is not None:
                    next(self._run)
            except StopIteration:
                self.programs += 1
                self._end_program()
            # A program that waits for data makes time stand still no longer than this [s].
            if self._starved is not None and self.options.wait_for_points and now - self._starved < 2.0:
                self._due_from = now
                break
            self._due_from += step
            self._report(self._arm.tick())
            self._ticks += 1
        # The port for programs reports the state in such a period [s].
        if now - self._said > 0.1:
            self._said = now
            for client in list(self._scripts.clients):
                self._say(self._scripts, client, struct.pack(">iB", 5, 16))

    def _report(self, sample: ArmSample) -> None:
        tau = np.zeros(UR_JOINTS) if sample.tau is None else sample.tau
        q, dq, ddq = sample.q[None], sample.dq[None], sample.ddq[None]
        # A motor makes 10 N m/A, and all joints are at 30 degC.
        values: Mapping[str, Any] = {
            "timestamp": self.time,
            "actual_q": sample.q,
            "actual_qd": sample.dq,
            "actual_current": tau / 10.0,
            "target_moment": self._model.torque(q, dq, ddq, self._parameters)[0]
            if self._sending
            else [nan] * UR_JOINTS,
            "joint_temperatures": [30.0] * UR_JOINTS,
            "robot_mode": ROBOT_RUNNING - 2 * (self.options.state == "drives-off"),
            "safety_mode": int(self._safety),
            "runtime_state": PROGRAM_PLAYING if self.moving else PROGRAM_STOPPED,
            PLAYED: self._registers.get(24, 0),
            AS_TORQUE: tau,
        }
        for client in list(self._sending):
            if client not in self._state.clients:
                self._sending.discard(client)
                continue
            names = self._recipes[client]
            flat: list[Any] = [1]
            for name in names:
                flat += list(values[name]) if self._type(name) == "VECTOR6D" else [values[name]]
            body = body_format([self._type(name) for name in names]).pack(*flat)
            self._say(self._state, client, package(Command.DATA, body))

    def _count(self) -> None:
        """Counts a point, and has the faults that come after a number of them."""
        self.points += 1
        faults, count = self.options.faults, self.points
        if faults.silent_after is not None and count > faults.silent_after:
            self._silent = True
        if faults.error_after is not None and count > faults.error_after:
            self._safety = Safety.PROTECTIVE_STOP
        if faults.e_stop_after is not None and count > faults.e_stop_after:
            self._safety = Safety.ROBOT_EMERGENCY_STOP
        if faults.restart_after is not None and count > faults.restart_after and not self.restarts:
            self.restarts += 1
            self._scripts.forget()
            self._state.forget()
            self._ticks = 0
            raise Halt
        if self.error:
            raise Halt

    def _commands(self) -> dict[str, Callable[..., Run]]:
        """Gives the commands that programs may use; each yields once for a cycle that it takes."""

        def servoj(q: list[float], a: float, v: float, t: float, lookahead: float, gain: float) -> Run:
            self._count()
            start = self._arm.command
            cycles = max(int(np.ceil(t / self.cycle - 1e-6)), 1)
            for number in range(1, cycles + 1):
                self._arm.command = start + (np.array(q) - start) * (number / cycles)
                yield

        def stopj(a: float) -> Run:
            before, speed = self._arm.command, self._arm.speed
            while (fastest := np.abs(speed).max()) > 0:
                speed = speed * max(1 - a * self.cycle / fastest, 0.0)
                before = before + speed * self.cycle
                self._arm.command = before
                yield

        def get_actual_joint_positions() -> Run:
            return self._arm.pose.tolist()
            yield

        def norm(value: Any) -> Run:
            return float(np.linalg.norm(np.atleast_1d(value)))
            yield

        def popup(
            text: str, title: str = "", warning: bool = False, error: bool = False, blocking: bool = False
        ) -> Run:
            self.said.append(text)
            while blocking:
                yield

        def halt() -> Run:
            raise Halt
            yield

        def write_output_integer_register(number: int, value: int) -> Run:
            self._registers[number] = value
            return
            yield

        def socket_open(host: str, port: int, name: str) -> Run:
            try:
                self._wire = socket.create_connection((host, port), timeout=1.0)
            except OSError:
                return False
            self._wire.setblocking(False)
            return True
            yield

        def socket_read_binary_integer(count: int, name: str, timeout: float) -> Run:
            begin, first = time.monotonic(), self._ticks
            while len(self._data) < 4 * count:
                if self._wire is not None:
                    with suppress(OSError):
                        self._data += self._wire.recv(65536)
                if len(self._data) >= 4 * count:
                    break
                if (self._ticks - first) * self.cycle > timeout:
                    return [0]
                self._starved = begin
                yield
            data, self._data = self._data[: 4 * count], self._data[4 * count :]
            return [count, *struct.unpack(f">{count}i", data)]

        def socket_close(name: str) -> Run:
            if self._wire is not None:
                self._wire.close()
                self._wire = None
            return
            yield

        found = (servoj, stopj, get_actual_joint_positions, norm, popup, halt, write_output_integer_register)
        return {each.__name__: each for each in (*found, socket_open, socket_read_binary_integer, socket_close)}
