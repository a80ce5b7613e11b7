"""Recordings of other programs go into `oed identify` without a mapping."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from estimation import identify, load_model, read_log
from robots.loading import load_robot
from robots.signals import Log
from tests.estimation.logs import recordings
from tests.estimation.logs.ros_messages.test_ros_messages import JOINT_STATE, Bag

pytestmark = pytest.mark.slow

NAMES = ("lift", "swing")
CONSTANTS = "  drives:\n    gear_ratio: {values: [1, 1]}\n    torque_constant: {values: [10, 10]}\n"


@pytest.fixture(scope="session")
def signals(experiment: Path):
    """Give t, q, dq and tau of a log of the robot with two joints, at 100 Hz: short, for the sake of time."""
    log = read_log(experiment / "log.csv")
    dq = np.gradient(log.q, log.t, axis=0)
    rows = slice(1000, 5000, 5)
    return np.round(log.t[rows], 9), log.q[rows], dq[rows], log.tau[rows]


@pytest.fixture(scope="session")
def expected(robot: Path, signals):
    """Identify from the same log in memory."""
    t, q, _, tau = signals
    return identify(load_robot(robot), [Log(t=t, q=q, tau=tau)]).model.values


def save_bag(folder: Path, t, q, dq, tau) -> Path:
    """Write a folder of rosbag 2, joints in the other order."""
    bag = Bag(folder, "db3")
    for row, time in enumerate(t):
        stamp = bag.make("builtin_interfaces/msg/Time", sec=100 + int(time), nanosec=round(time % 1 * 1e9))
        state = bag.make(
            JOINT_STATE,
            header=bag.make("std_msgs/msg/Header", stamp=stamp, frame_id=""),
            name=list(NAMES[::-1]),
            position=q[row, ::-1].copy(),
            velocity=dq[row, ::-1].copy(),
            effort=tau[row, ::-1].copy(),
        )
        if "/joint_states" not in bag.connections:
            bag.connections["/joint_states"] = bag.writer.add_connection(
                "/joint_states", JOINT_STATE, typestore=bag.store
            )
        packed = bag.store.serialize_cdr(state, JOINT_STATE)
        bag.writer.write(bag.connections["/joint_states"], 10**9 + round(time * 1e9), packed)
    return bag.close()


WRITERS = {
    "ur_rtde": lambda path, *s: recordings.ur_rtde(path, *s, torque=("target_moment", "actual_current")),
    "rostopic": lambda path, *s: recordings.rostopic(path, *s, names=NAMES),
    "savetxt": recordings.savetxt,
    "bag": lambda path, *s: save_bag(path.with_suffix(""), *s),
}


@pytest.mark.parametrize("kind", WRITERS)
def test_recording_is_identified_like_the_log(run, kind, robot: Path, signals, expected, tmp_path: Path) -> None:
    """Each format gives the parameters of the same log with its own names."""
    described = robot
    if kind == "ur_rtde":
        described = tmp_path / "two.yaml"
        described.write_text(robot.read_text() + CONSTANTS)
    path = WRITERS[kind](tmp_path / "recording.csv", *signals)
    done = run("identify", "--robot", described, "--log", path, "--out", tmp_path / "out", "--json")
    assert done.code == 0, done.err
    found = load_model(tmp_path / "out").values
    # Times are nanoseconds since 1970 or since the robot's start, which moves the smoothing by less than this.
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-5)


def test_currents_without_torque_constants_say_what_to_do(run, robot: Path, signals, tmp_path: Path) -> None:
    """The advice is followed in both ways: torque constants in a mapping, or the commanded torques."""
    path = WRITERS["ur_rtde"](tmp_path / "recording.csv", *signals)
    line = ("identify", "--robot", robot, "--log", path, "--json", "--out")
    done = run(*line, tmp_path / "a")
    assert done.code == 2
    assert "torque_constant: [...]" in done.err
    mapping = tmp_path / "mapping.yaml"
    mapping.write_text("torque_constant: [10, 10]\n")
    np.testing.assert_allclose(read_log(path, 2, mapping=mapping).tau, signals[3], rtol=1e-14)
    mapping.write_text(done.err.split("with `", 1)[1].split("`", 1)[0] + "\n")
    np.testing.assert_allclose(read_log(path, 2, mapping=mapping).tau, signals[3], rtol=1e-14)


def test_libfranka_log_is_identified(run, tmp_path: Path) -> None:
    """Seven joints of a Franka robot in the format of libfranka are identified."""
    from robots.plants import nominal_plant, simulate
    from robots.signals import Motion

    panda = load_robot("panda")
    t = 0.025 * np.arange(450)[:, None]
    middle, half = (panda.limits.upper + panda.limits.lower) / 2, (panda.limits.upper - panda.limits.lower) / 2
    rates = 2 * np.pi * np.array([1, 3]) / 10.0
    phases = np.random.default_rng(0).uniform(0, 6, (2, 7))
    waves = [(0.2 * half, rate, phase) for rate, phase in zip(rates, phases, strict=True)]
    motion = Motion(
        t=t[:, 0],
        q=middle + sum(a * np.sin(w * t + p) for a, w, p in waves),
        dq=sum(a * w * np.cos(w * t + p) for a, w, p in waves),
        ddq=-sum(a * w**2 * np.sin(w * t + p) for a, w, p in waves),
    )
    log = simulate(nominal_plant(panda), motion)
    path = recordings.libfranka(tmp_path / "log.csv", log.t, log.q, motion.dq, log.tau)
    done = run("identify", "--robot", "panda", "--friction", "coulomb-viscous", "--log", path, "--out", tmp_path / "m")
    assert done.code == 0, done.err
    assert "libfranka recording; its torque is state.tau_J[0] to state.tau_J[6]" in done.out
