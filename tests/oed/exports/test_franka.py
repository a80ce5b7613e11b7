"""Franka: what libfranka's rate limiter passes, and the program that plays and logs."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import oed
from estimation import read_log
from oed.exports import export_trajectory
from oed.exports.forms.sampling import at_period
from robots.common.errors import InputError
from robots.loading import load_robot
from robots.robot import Robot
from robots.signals import Motion
from tests.oed.exports import libfranka
from tests.oed.exports.libfranka import limited

STUBS = Path(__file__).parent / "franka_stubs"


@pytest.mark.parametrize("name", ["panda", "fr3"])
def test_the_limiter_limits(name: str) -> None:
    """The limiter changes a step, a jerk and a speed beyond its limits, and passes a slow motion to rounding."""
    t = 0.001 * np.arange(2000)
    middle = load_robot(name).limits.middle
    slow = middle + np.outer(0.1 * np.sin(np.pi * t / t[-1]) ** 4, np.ones(7))
    assert limited(slow, name)[1].max() < 1e-12
    step = middle + np.where(t[:, None] > 0.5, 0.01, 0.0)
    assert limited(step, name)[1].max() > 1e-3
    fast = middle + np.outer(10 * np.sin(np.pi * t / t[-1]) ** 4, np.ones(7))
    assert limited(fast, name)[1].max() > 1.0


def test_limits_near_the_ends() -> None:
    """The FR3's velocity limits of the catalogue are libfranka's at each pose, less what the limiter needs."""
    fr3 = load_robot("fr3")
    assert fr3.limits.ramp is not None
    rng = np.random.default_rng(0)
    q = rng.uniform(fr3.limits.lower, fr3.limits.upper, (500, 7))
    for pose in q:
        upper, lower = libfranka.fr3_limits(pose)
        for sign, bound in ((1.0, upper), (-1.0, -lower)):
            ours = fr3.limits.ramp.allowed(pose, np.full(7, sign), fr3.limits.velocity)
            np.testing.assert_allclose(ours, np.maximum(bound - 0.02, 0.0), atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["panda", "fr3"])
def test_designs_pass_the_limiter(name: str) -> None:
    """A design passes the limiter unchanged, and stays 0.029 rad from the maker's position limits."""
    robot = load_robot(name)
    # The limits hold for any design; a long search would only make it a better one.
    limits, search = oed.LimitOptions(collision=False), oed.SearchOptions(effort="quick", seed=1, time_limit=3.0)
    motion = oed.design(robot, limits=limits, search=search).motion
    played = at_period(motion, 0.001)
    assert limited(played.q, name)[1].max() < 1e-9
    margin = min((played.q - robot.limits.lower).min(), (robot.limits.upper - played.q).min())
    assert margin > -1e-9


def swing(robot: Robot) -> Motion:
    """A slow motion from home, at 1 kHz."""
    t = 0.001 * np.arange(1001)
    w = np.pi / t[-1]
    size = np.linspace(0.2, 0.1, 7)
    s, c = np.sin(w * t), np.cos(w * t)
    q = robot.limits.middle + np.outer(s**4, size)
    dq = np.outer(4 * w * s**3 * c, size)
    return Motion(t, q, dq, np.outer(4 * w**2 * (3 * s**2 * c**2 - s**4), size))


@pytest.fixture(scope="module")
def player(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Compile the exported program against headers of libfranka's signatures."""
    compiler = shutil.which("g++") or shutil.which("clang++")
    if compiler is None:
        pytest.skip("no C++ compiler: g++ or clang++ compiles the exported program")
    folder = tmp_path_factory.mktemp("player")
    robot = load_robot("fr3")
    export_trajectory(folder / "player.cpp", swing(robot), robot, "franka-player")
    flags = ["-std=c++17", "-O1", "-Wall", "-Wextra", "-Werror", f"-I{STUBS}", "-pthread"]
    done = subprocess.run(
        [compiler, *flags, "player.cpp", "-o", "player"], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return folder / "player"


def run(player: Path, folder: Path, *words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run the program on a stub of an arm."""
    line = [str(player), *words]
    return subprocess.run(
        line, cwd=folder, env=os.environ | environment, capture_output=True, text=True, check=False, timeout=60
    )


@pytest.fixture
def trajectory(tmp_path: Path) -> Motion:
    """Write a trajectory for the player whose joints all begin at one position."""
    robot = load_robot("fr3")
    motion = swing(robot)
    export_trajectory(tmp_path / "t.csv", motion, robot, "franka")
    return motion


def moved_to(motion: Motion, pose: float, folder: Path) -> Motion:
    """Shift the file's joints to one start position; the stub of the arm has them at one place."""
    lines = (folder / "t.csv").read_text().splitlines()
    shift = pose - motion.q[0]
    q = motion.q + shift
    rows = [",".join(map(repr, [t, *row])) for t, row in zip(motion.t.tolist(), q.tolist(), strict=True)]
    (folder / "t.csv").write_text("\n".join([lines[0], *rows, ""]))
    return Motion(motion.t, q, motion.dq, motion.ddq)


@pytest.mark.slow
def test_player(player: Path, trajectory: Motion, tmp_path: Path) -> None:
    """It brings the arm to the first point, plays each point at its time, and writes a log that is read as it is."""
    motion = moved_to(trajectory, 0.3, tmp_path)
    for lose in ("", "50"):
        log = tmp_path / f"log{lose}.csv"
        words = ("host", "t.csv", log.name)
        done = run(player, tmp_path, *words, POSE="0.305", **({"LOSE": lose} if lose else {}))
        assert (done.returncode, done.stderr) == (0, "")
        sent = np.loadtxt(tmp_path / "commands.csv", delimiter=",")
        times = sent[:, 7].astype(int)
        played = times >= 2000
        np.testing.assert_allclose(sent[played, :7], motion.q[times[played] - 2000], atol=1e-9)
        assert np.abs(np.diff(sent[:, :7], axis=0)).max() < 0.004
        if not lose:
            # The stub's joints stand at one pose, which not all of the FR3 can have.
            assert limited(sent[:, :7], "panda")[1].max() < 1e-9
        read = read_log(log, 7)
        assert len(read) == len(sent)
        np.testing.assert_allclose(read.q[1:], sent[:-1, :7], atol=1e-9)
        np.testing.assert_allclose(read.tau[1:, 2], 3 + sent[:-1, 2], atol=1e-9)


@pytest.mark.slow
def test_player_refuses(player: Path, trajectory: Motion, tmp_path: Path) -> None:
    """Another pose, a wrong file, an existing log, no robot and an arm that stays behind end with one message."""
    moved_to(trajectory, 0.3, tmp_path)
    for words, environment, code, problem in (
        (("host", "t.csv", "a.csv"), {"POSE": "0.4"}, 2, "joint 1: the arm is at 0.4 rad, the plan is 0.3 rad"),
        (("host", "missing.csv", "a.csv"), {"POSE": "0.3"}, 2, "missing.csv cannot be read"),
        (("nowhere", "t.csv", "a.csv"), {"POSE": "0.3"}, 1, "refused"),
        (("host", "t.csv"), {}, 2, "usage"),
    ):
        done = run(player, tmp_path, *words, **environment)
        assert done.returncode == code
        assert problem in done.stderr
        assert not (tmp_path / "a.csv").exists()
        assert not (tmp_path / "commands.csv").exists() or not (tmp_path / "commands.csv").stat().st_size
    done = run(player, tmp_path, "host", "t.csv", "a.csv", "--dry-run", POSE="0.3")
    assert (done.returncode, done.stdout) == (0, "1001 points may be played; nothing was sent\n")
    done = run(player, tmp_path, "host", "t.csv", "a.csv", POSE="0.3", STALL="2200")
    assert done.returncode == 1
    assert "the arm has left the plan" in done.stderr
    assert len(read_log(tmp_path / "a.csv", 7)) > 2200
    done = run(player, tmp_path, "host", "t.csv", "a.csv", POSE="0.3")
    assert (done.returncode, "a.csv exists" in done.stderr) == (2, True)
    (tmp_path / "t.csv").write_text("time,q1\n0.0,1.0\n")
    done = run(player, tmp_path, "host", "t.csv", "b.csv", POSE="0.3")
    assert (done.returncode, "row 2 has no time and seven positions" in done.stderr) == (2, True)


def test_player_is_for_franka_arms(tmp_path: Path) -> None:
    """A robot with other joints gets no program."""
    er3a = load_robot("er3a")
    motion = swing(load_robot("fr3"))
    with pytest.raises(InputError):
        export_trajectory(tmp_path / "p.cpp", motion, er3a, "franka-player")
