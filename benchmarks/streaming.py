"""Points a second, jitter of the feedback, streams under faults, drivers, watched paths, hostile datagrams.

Everything stays on 127.0.0.1. Usage: ``python benchmarks/streaming.py [speed|faults|drivers|path|hostile]``
"""

from __future__ import annotations

import argparse
import platform
import random
import socket
import sys
import tempfile
import threading
import time
import warnings
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any, get_args

sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np

from benchmarks.memory import peak_memory
from estimation import read_log
from oed.controllers import (
    ControllerOptions,
    Endpoint,
    Faults,
    StreamOptions,
    VirtualController,
    stream,
    virtual_controller,
)
from oed.controllers.clients.requests import Requests
from oed.controllers.clients.watching import USUAL_ANGLE_TOLERANCE
from oed.controllers.drivers import DRIVERS
from oed.controllers.links import open_link
from oed.controllers.recording.recorder import Recorder
from oed.controllers.virtual_options import PathKind
from oed.exports.forms.sampling import at_period
from oed.exports.simple_message import (
    DEFAULT,
    Comm,
    Frame,
    FullPoint,
    JointPosition,
    MessageError,
    Ping,
    Reply,
    Special,
    WireFormat,
)
from robots.common.errors import OedError
from robots.loading import load_robot
from robots.robot import Robot
from robots.signals import Log, Motion

PERIOD = 0.004
BURST = 100
FORMATS = [WireFormat(byte_order=order, real_bytes=size) for order in ("little", "big") for size in (4, 8)]  # type: ignore[arg-type]


def swing(robot: Robot, points: int) -> Motion:
    """Makes a slow motion with rest at both ends: sine in a sin^2 envelope."""
    t = PERIOD * np.arange(points)
    w, e = 2 * np.pi * 0.2, np.pi / t[-1]
    size = np.linspace(0.4, 0.2, robot.n)
    window, rise, bend = np.sin(e * t) ** 2, e * np.sin(2 * e * t), 2 * e**2 * np.cos(2 * e * t)
    s, c = np.sin(w * t), np.cos(w * t)
    q = robot.limits.home + np.outer(window * s, size)
    dq = np.outer(rise * s + window * w * c, size)
    ddq = np.outer(bend * s + 2 * rise * w * c - window * w * w * s, size)
    return Motion(t, q, dq, ddq)


def play(robot: Robot, motion: Motion, transport: str, options: StreamOptions, **settings: Any) -> None:
    """Streams a motion once and prints what happened."""
    choices = ControllerOptions(transport=transport, motion_port=0, state_port=0, **settings)  # type: ignore[arg-type]
    with tempfile.TemporaryDirectory() as folder, VirtualController(robot, options=choices) as controller:
        endpoint = Endpoint(
            host="127.0.0.1",
            transport=transport,  # type: ignore[arg-type]
            motion_port=controller.motion_port,
            state_port=controller.state_port,
        )
        log = Path(folder) / "log.csv"
        try:
            result = stream(motion, robot, endpoint, log=log, options=options)
        except OedError as error:
            print(f"{transport}: ended: {error.problem}; {controller.points} points played")
            return
        feedback = result.feedback
        print(
            f"{transport}: {result.sent} of {len(motion)} points, {result.sent / result.duration:.0f} points/s, "
            f"{result.resent} sent again, {result.unexpected} late or repeated replies, delay "
            f"{1e3 * (result.delay or 0):.3g} ms; feedback: {feedback['rows']} rows, {feedback['lost']} lost, jitter "
            f"{1e3 * feedback['arrival_jitter']:.3g} ms, longest gap {1e3 * feedback['longest_gap']:.3g} ms"
        )
        read = read_log(log, robot.n)
        moving = np.flatnonzero(np.abs(read.q - motion.q[0]).max(axis=1) > 1e-6)
        print(f"    time stamps in order: {bool((np.diff(read.t) > 0).all())}, rows in motion: {np.ptp(moving) + 1}")


def watch_paths(robot: Robot, runs: int) -> None:
    """Plays runs without a fault and with each fault of the path, 5 % of the datagrams late by 50 ms."""
    motion = swing(robot, 750)
    options = StreamOptions(window=32, patience=5.0)
    for feedback in ("full", "position"):
        for path in get_args(PathKind):
            ends: Counter[str] = Counter()
            delays = []
            for seed in range(runs if path == "none" else max(runs // 10, 1)):
                faults = Faults(late=0.05, late_by=0.05, seed=seed, path=path, path_after=1.0)
                choices = ControllerOptions(
                    motion_port=0, state_port=0, feedback=feedback, replies="echo", capacity=200, faults=faults
                )
                with tempfile.TemporaryDirectory() as folder, VirtualController(robot, options=choices) as controller:
                    endpoint = Endpoint(
                        host="127.0.0.1", motion_port=controller.motion_port, state_port=controller.state_port
                    )
                    log = Path(folder) / "log.csv"
                    try:
                        stream(motion, robot, endpoint, log=log, options=options)
                        ends["played"] += 1
                    except OedError as error:
                        stopped = "left the plan" in error.problem
                        # A busy computer makes the clock of the test controller stand still: its robot then is late.
                        late = ", where the test controller had stalled" if controller.stalled else ""
                        ends["stopped" + late if stopped else error.problem] += 1
                        if stopped and feedback == "full":
                            delays.append(stop_delay(read_log(log, robot.n, torque=False), motion))
            found = f", {max(delays):.3f} s after the robot left the tolerance at most" if delays else ""
            print(f"  feedback {feedback}, fault {path}: {dict(ends)}{found}", flush=True)


def with_drivers(robot: Robot) -> None:
    """Plays 2,000 points with each driver's profile, then has them stopped in the middle, refused, and played again."""
    for name, driver in DRIVERS.items():
        # A UR controller has six joints of its own kind.
        arm = load_robot("ur10") if driver.protocol == "rtde" else robot
        motion = swing(arm, 2000)
        played = motion if driver.most is None else at_period(motion, motion.duration / (driver.most - 1))
        options = StreamOptions.of(driver, patience=5.0)
        for title, settings in (
            ("played twice", {}),
            ("leaves the plan", {"faults": Faults(path="offset", path_after=4.0)}),
            ("emergency stop after 500 points", {"faults": Faults(e_stop_after=500)}),
            ("emergency stop before", {"state": "e-stop"}),
        ):
            choices = ControllerOptions.of(driver, motion_port=0, state_port=0, **settings)  # type: ignore[arg-type]
            with tempfile.TemporaryDirectory() as folder, virtual_controller(arm, options=choices) as controller:
                ports = {"motion_port": controller.motion_port, "state_port": controller.state_port}
                place = Endpoint.of(driver, "127.0.0.1", handshake_interval=0.1, **ports)
                text = ""
                for _ in range(2 if title == "played twice" else 1):
                    try:
                        log = Path(folder) / "log.csv"
                        result = stream(played, arm, place, log=log, options=options, force=True)
                        text += f"{result.sent} of {result.points} points, stop confirmed: {result.stopped}; "
                    except OedError as error:
                        confirmed = "did not confirm" not in str(error)
                        text += f"{error.problem}; stop confirmed: {confirmed}; {controller.points} points came; "
                print(f"  {name}, {title}: {text}moves: {controller.moving}", flush=True)


def stop_delay(log: Log, motion: Motion) -> float:
    """Time from the first row beyond the usual tolerance to the end of the log [s]; rows are samples of the motion."""
    moved = int((np.abs(log.q - motion.q[0]).max(axis=1) > 1e-6).argmax())
    sample = int(np.abs(motion.q[:200] - log.q[moved]).max(axis=1).argmin())
    numbers = np.clip(sample + np.rint((log.t - log.t[moved]) / PERIOD).astype(int), 0, len(motion) - 1)
    away = np.abs(log.q - motion.q[numbers]).max(axis=1) > USUAL_ANGLE_TOLERANCE
    return float(log.t[-1] - log.t[away.argmax()])


def wait_until(done: Callable[[], bool]) -> None:
    """Waits until all datagrams were taken, so that none is lost on the way.

    Raises:
        AssertionError: they were not within ten seconds.
    """
    end = time.monotonic() + 10.0
    while not done():
        assert time.monotonic() < end, "not all datagrams were taken"
        time.sleep(0.0005)


def hostile(generator: random.Random) -> bytes:
    """Makes one datagram: random bytes, a message that was cut, or a message with wrong bytes."""
    kind = generator.randrange(3)
    if kind == 0:
        # One byte could be the handshake, which is no message.
        return generator.randbytes(generator.randrange(2, 400))
    data = bytearray(generator.choice(SAMPLES))
    if kind == 1:
        return bytes(data[: generator.randrange(2, len(data))])
    for _ in range(generator.randrange(1, 5)):
        data[generator.randrange(len(data))] = generator.randrange(256)
    return bytes(data)


TEN = tuple(0.1 * k for k in range(10))
SAMPLES = [
    DEFAULT.encode(frame)
    for frame in (
        Frame(Ping(), Comm.REQUEST),
        Frame(Ping(), Comm.REPLY, Reply.SUCCESS),
        Frame(JointPosition(sequence=5, positions=TEN)),
        Frame(FullPoint(sequence=3, time=0.1, positions=TEN, velocities=TEN, accelerations=TEN), Comm.REQUEST),
        Frame(FullPoint(sequence=Special.STOP, time=0.0, positions=(), velocities=(), accelerations=()), Comm.REQUEST),
    )
]


def attack_codec(count: int, end: float) -> None:
    """Decodes hostile bytes in every format."""
    generator, refused = random.Random(0), 0
    for k in range(count):
        try:
            FORMATS[k % 4].decode(hostile(generator))
        except MessageError:
            refused += 1
        if time.monotonic() > end:
            count = k + 1
            break
    print(f"codec: {count} datagrams, {refused} refused, {count - refused} messages")


def attack_controller(robot: Robot, count: int, end: float) -> None:
    """Floods both ports of a controller; it must still answer after each burst."""
    generator, sent = random.Random(1), 0
    options = ControllerOptions(motion_port=0, state_port=0, feedback="full", feedback_period=0.1)
    with VirtualController(robot, options=options) as controller:
        endpoint = Endpoint(host="127.0.0.1", motion_port=controller.motion_port, state_port=controller.state_port)
        with (
            open_link(endpoint, endpoint.motion_port) as motion,
            open_link(endpoint, endpoint.state_port) as state,
        ):
            while sent < count and time.monotonic() < end:
                for _ in range(BURST):
                    (motion if generator.random() < 0.7 else state).send(hostile(generator))
                sent += BURST
                # Two handshakes came first.
                wait_until(lambda sent=sent: controller.received >= sent + 2)
            assert Requests(motion, DEFAULT, StreamOptions()).ping() > 0
        print(f"controller: {sent} datagrams, {controller.malformed} refused; it answers")


def attack_client(robot: Robot, count: int, end: float) -> None:
    """Floods the listener of a client; it must still take feedback."""
    generator, sent = random.Random(2), 0
    server = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    server.bind(("127.0.0.1", 0))
    client: list[Any] = []

    def shake_hands() -> None:
        byte, address = server.recvfrom(10)
        server.sendto(byte, address)
        client.append(address)

    thread = threading.Thread(target=shake_hands)
    thread.start()
    endpoint = Endpoint(host="127.0.0.1", state_port=server.getsockname()[1])
    recorder = Recorder(open_link(endpoint, endpoint.state_port), robot, DEFAULT, 10.0, 10.0)
    thread.join()
    while sent < count and time.monotonic() < end:
        for _ in range(BURST):
            server.sendto(hostile(generator), client[0])
        sent += BURST
        wait_until(lambda sent=sent: recorder.received >= sent or recorder.error is not None)
        if recorder.error is not None:
            break
    if recorder.error is not None:
        # A random message may say that the controller restarted: the one clean end that is allowed.
        print(f"client ended: {recorder.error.problem}")
    print(f"client: {sent} datagrams, {recorder.statistics.malformed} refused")
    recorder.finish({})
    server.close()


def main() -> None:
    """Runs what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", nargs="*", default=["speed", "faults", "drivers", "path", "hostile"])
    parser.add_argument("--count", type=int, default=1_000_000, help="datagrams")
    parser.add_argument("--points", type=int, default=25_000, help="points of a trajectory")
    parser.add_argument("--speed", type=float, default=10.0, help="times real time")
    parser.add_argument("--runs", type=int, default=100, help="watched runs without a fault; a tenth with each")
    parser.add_argument("--limit", type=float, default=300.0, help="time limit of each part [s]")
    args = parser.parse_args()
    warnings.simplefilter("ignore")
    print(platform.platform(), platform.processor(), f"Python {platform.python_version()}")
    robot = load_robot("er3a")
    motion = swing(robot, args.points)
    for part in args.what:
        print(part)
        if part == "speed":
            for transport in ("udp", "tcp"):
                play(robot, motion, transport, StreamOptions(), speed=args.speed, wait_for_points=True)
        elif part == "faults":
            faults = Faults(lose=0.05, double=0.05, late=0.05)
            for replies, window in (("echo", 32), ("bare", 1)):
                print(f"  replies {replies}, window {window}")
                options = StreamOptions(window=window, patience=5.0)
                play(
                    robot,
                    motion,
                    "udp",
                    options,
                    speed=args.speed,
                    wait_for_points=True,
                    faults=faults,
                    replies=replies,
                )
        elif part == "drivers":
            with_drivers(robot)
        elif part == "path":
            watch_paths(robot, args.runs)
        elif part == "hostile":
            before = peak_memory()
            third = args.count // 3
            for attack in (
                attack_codec,
                lambda n, e: attack_controller(robot, n, e),
                lambda n, e: attack_client(robot, n, e),
            ):
                attack(third + 1, time.monotonic() + args.limit)
            print(f"peak memory {before:.3f} GB before, {peak_memory():.3f} GB after")
        else:
            parser.error(f"{part}: speed, faults, drivers, path or hostile")


if __name__ == "__main__":
    main()
