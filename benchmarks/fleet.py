"""A fleet of 1,000 logs of a minute: the time that `oed fleet` takes, and whether a kill costs only unfinished work.

Run ``python benchmarks/fleet.py FOLDER [ROBOTS [LOGS]]``; by default 50 robots with 20 logs each, at 125 Hz, in
folders of CSV files. Models come from `monitoring.py`: one each for the first five robots, the others are copies of
these with other motions, noise and temperatures. Every tenth robot has 30 % more friction of one joint from the middle
log on. Three robots have one corrupt log: cut within a row, empty, or of text. The program is killed (SIGKILL) after a
third of the robots is done, and started again.
"""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np

from benchmarks.monitoring import LOGGED, robot_of, trained
from benchmarks.monitoring_parts.virtual_robot import Cause
from estimation.logs.writing import write_log
from robots.signals import Log

MODELS = (1, 2, 3, 4, 5)
PAUSE = 1800.0
CORRUPT = {3: lambda text: text[: len(text) // 2 - 7], 7: lambda text: "", 8: lambda text: "not a log\n" * 20}


def write_fleet(folder: Path, models: Path, robots: int, logs: int) -> dict[str, int]:
    """Writes the logs and a model of each robot, and returns the damaged joint of the damaged ones."""
    damaged = {}
    for number in range(robots):
        seed, name = MODELS[number % len(MODELS)], f"robot{number:03}"
        place = folder / name
        place.mkdir(parents=True)
        if not (models / f"robot{seed}.json").exists():
            trained(models, seed)
        content = json.loads((models / f"robot{seed}.json").read_text())["thermal"]
        (place / "model.json").write_text(json.dumps(content))
        robot = robot_of(seed)
        robot.rng = np.random.default_rng([number, 20])
        robot.rest(robot.rng.uniform(0.2, 1.0) * 86400.0)
        motions = [0, 1, robot.add_motion()]
        if number % 10 == 5:
            joint = int(robot.rng.integers(1, robot.n + 1))
            moment = robot.clock + (logs // 2) * (LOGGED + PAUSE) - 5.0
            robot.causes = [Cause(kind="damage", time=moment, joint=joint, amount=0.3)]
            damaged[name] = joint
        for k in range(logs):
            log = robot.log(LOGGED, motions[k % 3])
            write_log(place / f"log{k:02}.csv", Log(log.t[::2], log.q[::2], log.tau[::2]))  # type: ignore[index]
            robot.rest(PAUSE)
        if number in CORRUPT:
            file = place / f"log{logs // 2:02}.csv"
            file.write_text(CORRUPT[number](file.read_text()))
    return damaged


def main() -> int:
    """Writes the fleet, kills the program once, lets it finish, and prints what came out."""
    if len(sys.argv) < 2:
        print(__doc__)
        return 2
    folder = Path(sys.argv[1])
    robots, logs = (int(sys.argv[k]) if len(sys.argv) > k else default for k, default in ((2, 50), (3, 20)))
    damaged = write_fleet(folder / "logs", folder, robots, logs)
    out = folder / "out"
    command = [sys.executable, "-m", "oed", "fleet", str(folder / "logs"), "--workers", "2", "--out", str(out)]
    command += ["--model", str(folder / "logs" / "robot000" / "model.json")]
    began = time.perf_counter()
    first = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while first.poll() is None and len(_done(out)) < robots // 3:
        time.sleep(0.2)
    first.send_signal(signal.SIGKILL)
    first.wait()
    kept = _done(out)
    killed = time.perf_counter() - began
    finished = subprocess.run(command, capture_output=True, text=True)
    spent = time.perf_counter() - began
    again = sum(_done(out)[name] != when for name, when in kept.items())
    rows = {row["robot"]: row for row in json.loads((out / "fleet.json").read_text())["robots"]}
    named = sum(
        any(f["kind"] == "damage" and f["joint"] == joint for f in rows[name]["findings"])
        for name, joint in damaged.items()
    )
    healthy = [row for name, row in rows.items() if name not in damaged]
    print(f"exit code {finished.returncode}; {robots * logs} logs of {LOGGED:.0f} s in {spent:.0f} s on two processes")
    print(f"killed after {killed:.0f} s with {len(kept)} robots done; {again} of these were done again")
    red = sum(row["light"] == "red" for row in healthy)
    print(f"damaged robots named {named} of {len(damaged)}; healthy ones red {red} of {len(healthy)}")
    print(finished.stdout.splitlines()[-2].strip())
    return finished.returncode


def _done(out: Path) -> dict[str, float]:
    """Times at which the kept robots were written."""
    return {file.name: file.stat().st_mtime for file in (out / "robots").glob("*.state.json")}


if __name__ == "__main__":
    sys.exit(main())
