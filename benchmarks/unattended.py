"""Loops and campaigns without anybody, as a user types them, on the test controllers of two drivers.

Each virtual robot has a hidden effect. A loop designs, plays, identifies and diagnoses by itself; a campaign is
planned, played and diagnosed. Everything stays on 127.0.0.1. Usage: ``python benchmarks/unattended.py [generic|ur]``
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
SPEED = 10

PLANT = (
    "{spread: 0.1, sensors: {torque_noise: 0.01}, effects: [{effect: spring, joint: 2, parameters: {stiffness: %g}}]}"
)
HIDDEN = "spring", 2
STIFFNESS = {"generic": 8.0, "ur": 25.0}

UR = """\
name: ur10
urdf: {urdf}
tip: tool0
limits:
  acceleration: {{values: 5, unit: rad/s2, source: assumed}}
  jerk: {{values: 100, unit: rad/s3, source: assumed}}
dynamics: {{drives: {{gear_ratio: {{values: 100}}, torque_constant: {{values: 0.1}}}}}}
period: 0.008
"""
"""A CB controller reports currents: 0.1 N m/A and a gear of 100 make the 10 N m/A of the test controller."""


def oed(*words: object, folder: Path) -> tuple[int, dict[str, Any], float]:
    """Runs a command; gives its exit code, what it says as JSON, and the time it took [s]."""
    begin = time.monotonic()
    line = [sys.executable, "-W", "ignore", "-m", "oed", *map(str, words), "--json", "--quiet"]
    done = subprocess.run(
        line, cwd=folder, env=os.environ | {"PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=False
    )
    if done.returncode not in (0, 1) or not done.stdout.strip():
        print(done.stderr, file=sys.stderr)
    return done.returncode, json.loads(done.stdout or "{}"), time.monotonic() - begin


@contextmanager
def controller(driver: str, robot: str, pose: Path, folder: Path) -> Iterator[list[object]]:
    """Starts ``oed controller``; gives the options of its clients."""
    line = [sys.executable, "-W", "ignore", "-m", "oed", "controller", "--driver", driver, "--robot", robot]
    line += ["--plant", "plant.yaml", "--pose", str(pose), "--speed", str(SPEED), "--wait-for-points"]
    line += ["--motion-port", "0", "--state-port", "0", *(["--feedback", "torque"] if driver == "generic" else [])]
    process = subprocess.Popen(
        line,
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stderr is not None
    try:
        ports = None
        while ports is None:
            text = process.stderr.readline()
            assert text, "the controller has ended"
            ports = re.search(r"motion port (\d+), state port (\d+)", text)
        yield ["--driver", driver, "--motion-port", ports[1], "--state-port", ports[2], "--patience", 10]
    finally:
        process.terminate()
        process.communicate()


def named(diagnosis: dict[str, Any]) -> str:
    """Says what a diagnosis found."""
    found = [f"{each['effect']} (joint {each['joint']})" for each in diagnosis["findings"]]
    right = [(each["effect"], each["joint"]) for each in diagnosis["findings"]] == [HIDDEN]
    return f"{diagnosis['verdict']}: {', '.join(found) or 'nothing'}; {'right' if right else 'WRONG'}"


def run(driver: str, folder: Path) -> None:
    """Runs a loop and a campaign of one driver."""
    robot = "er3a"
    if driver == "ur":
        robot = "ur10.yaml"
        (folder / robot).write_text(UR.format(urdf=ROOT / "robots" / "catalog" / "ur10.urdf"))
    (folder / "plant.yaml").write_text(PLANT % STIFFNESS[driver])
    code, _, seconds = oed("design", "--robot", robot, "--effort", "quick", "--out", "design", folder=folder)
    print(f"{driver}: design {seconds:.0f} s, exit code {code}", flush=True)
    with controller(driver, robot, folder / "design" / "trajectory.csv", folder) as place:
        words = ["loop", "--robot", robot, "--host", "127.0.0.1", *place, "--speed", SPEED, "--design", "design"]
        code, loop, seconds = oed(*words, folder=folder)
        diagnosis = json.loads((folder / "loop" / "diagnosis.json").read_text())
        ended = f"experiments: {len(loop['experiments'])}, {loop['ended']}; {named(diagnosis)}"
        print(f"{driver}: loop {seconds:.0f} s, exit code {code}, {ended}", flush=True)
    words = ["campaign", "--robot", robot, "--design", "design", "--cycles", 2, "--cycle-time", 240, "--warm-up", 60]
    code, _, seconds = oed(*words, folder=folder)
    print(f"{driver}: campaign planned in {seconds:.0f} s, exit code {code}", flush=True)
    stages = json.loads((folder / "campaign" / "campaign.json").read_text())["stages"]
    first = folder / "campaign" / f"{stages[0]['name']}.csv"
    with controller(driver, robot, first, folder) as place:
        code, _, seconds = oed(
            *words, "--run", "127.0.0.1", *place, "--speed", SPEED, "--start-tolerance", 0.02, folder=folder
        )
    logs = sorted((folder / "campaign" / "logs").iterdir())
    print(f"{driver}: campaign of {len(logs)} stages played in {seconds:.0f} s, exit code {code}", flush=True)
    files = [word for log in logs for word in ("--log", log)]
    code, _, seconds = oed("diagnose", "--robot", robot, *files, "--out", "diagnosed", folder=folder)
    diagnosis = json.loads((folder / "diagnosed" / "diagnosis.json").read_text())
    print(f"{driver}: diagnosis {seconds:.0f} s, exit code {code}; {named(diagnosis)}", flush=True)


def main() -> None:
    """Runs what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("drivers", nargs="*", default=["generic", "ur"])
    for driver in parser.parse_args().drivers:
        with tempfile.TemporaryDirectory() as folder:
            run(driver, Path(folder))


if __name__ == "__main__":
    main()
