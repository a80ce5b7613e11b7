"""A disk that becomes full while `oed record` and `oed stream` write to it, in processes of their own."""

from __future__ import annotations

import os
import resource
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimation import read_log
from oed.exports import write_trajectory
from tests.oed.cli.conftest import ROBOT
from tests.oed.controllers.conftest import swing

pytestmark = pytest.mark.slow

ROOM = 40_960
"""Bytes of the disk: some 900 rows."""

MOUNTED = f"mount -t tmpfs -o size={ROOM} tmpfs disk && "
"""The disk is seen by this program only, and ends with it: what it holds is copied."""


def small_disk(folder: Path, line: list[object], kind: str) -> subprocess.CompletedProcess[str]:
    """Run a command that writes to the folder `disk`; what it wrote is in the folder `kept` afterwards.

    Args:
        folder: where it works.
        line: of the command, after ``oed``.
        kind: a small file system, or a limit of what one file may hold.
    """
    (folder / "disk").mkdir()
    words = [sys.executable, "-W", "ignore", "-m", "oed", *map(str, line)]
    root = Path(__file__).parents[3]
    settings: dict[str, Any] = {
        "cwd": folder,
        "env": {**os.environ, "PYTHONPATH": str(root)},
        "capture_output": True,
        "text": True,
    }
    if kind == "limit":
        limit = (ROOM, resource.RLIM_INFINITY)
        small = {"preexec_fn": lambda: resource.setrlimit(resource.RLIMIT_FSIZE, limit)}
        done = subprocess.run(words, **settings, **small, timeout=60, check=False)
        (folder / "disk").rename(folder / "kept")
        return done
    inside = ["unshare", "--user", "--map-root-user", "--mount", "sh", "-c"]
    try:
        subprocess.run([*inside, f"{MOUNTED}true"], **settings, timeout=60, check=True)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("this computer mounts no disks for users")
    script = f"{MOUNTED}{shlex.join(words)}; code=$?; cp -r disk kept; exit $code"
    return subprocess.run([*inside, script], **settings, timeout=60, check=False)


@pytest.mark.parametrize("kind", ["disk", "limit"])
@pytest.mark.parametrize("command", ["record", "stream"])
def test_full_disk(command: str, kind: str, robot, controllers, tmp_path: Path) -> None:
    """It ends with one message and exit code 2, the robot is stopped, and every row that is stated is in the log."""
    (tmp_path / "two.yaml").write_text(ROBOT.replace("VELOCITY", "2"))
    motion = swing(robot, 2000)
    write_trajectory(tmp_path / "motion.csv", motion)
    controller, endpoint = controllers(speed=3.0, wait_for_points=False)
    line: list[object] = [command, "--robot", "two.yaml", "--host", "127.0.0.1", "--state-port", endpoint.state_port]
    line += ["--log", "disk/log.csv", "--patience", 20]
    if command == "stream":
        line += ["motion.csv", "--motion-port", endpoint.motion_port]
    done = small_disk(tmp_path, line, kind)
    assert done.returncode == 2, done.stderr
    message = [row for row in done.stderr.splitlines() if not row.startswith(("note:", "progress:"))]
    assert len(message) == 1, done.stderr
    assert message[0].startswith("oed: disk/log.csv: recording stopped (")
    read = read_log(tmp_path / "kept" / "log.csv", robot.n)
    assert f"make room on the disk; {len(read)} rows are in disk/log.csv" in message[0]
    assert len(read) > 400
    assert read.metadata["complete"] is False
    if command == "stream":
        assert 0 < controller.points < len(motion)
        # Without a stop the controller would have run out of points, which is an error.
        assert (controller.player.moving, controller.player.error) == (False, 0)
        assert np.abs(controller.player.pose - motion.q[-1]).max() > 0.01
