"""Whether `oed monitor` finds damage under heat and nothing else, on virtual robots that share no code with it.

Run it with ``python benchmarks/monitoring.py FOLDER [STUDY] [COUNT]``, with one of the studies below or ``table``. Rows
go to files in FOLDER; a second run goes on where the first one ended. ``table`` prints the figures of all rows.

- thesis: friction of one joint rises by 32 % after 60 min of the second day, while heat changes the friction of all.
- night: the same change in the night before the second day: the first log of that day must show it.
- start: three logs, cold or warm, with known or other motions: of a healthy robot, or of one that had 30 % more
  friction of one joint before its first log.
- healthy: 100 h of heating and cooling without any change.
- weeks: five days of six 5 min cycles, with mixed causes.
- stops: the same of other robots, whose logs hold moves from point to point with stops; they were not used for tuning.
- speed: a stream of 6 joints at 250 Hz, how many times faster than real time it is followed.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
import time
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np

from benchmarks.monitoring_parts.tables import print_table
from benchmarks.monitoring_parts.virtual_robot import DAY, Cause, VirtualRobot
from benchmarks.monitoring_parts.weeks import draw_causes, size_of
from estimation import identify
from estimation.models.model import model_from_dict
from estimation.monitoring import Baseline, Monitor, MonitorSettings, baseline_of
from estimation.thermal import fit_campaign
from oed.benchmarks.truth.description import write_description
from robots import load_robot
from robots.signals import Log

# The charts were tuned with the first one.
ROBOTS = (1, 2, 3, 4, 5)
# Friction falls by half at full duty, so that a cold joint has 60 to 70 % more of it than a warm one.
FALL = 0.5
LOGGED, CYCLE, REST = 60.0, 300.0, 5.0
DAMAGE = 0.32
VARIANTS = {"thermal model": ("thermal", "model"), "assumed heat": ("plain", "common"), "no heat": ("plain", "none")}
# Variants of each study: more cost time.
STUDIED = {
    "thesis": tuple(VARIANTS),
    "start": ("thermal model", "assumed heat"),
    "healthy": ("thermal model",),
    "weeks": ("thermal model",),
    "stops": ("thermal model", "assumed heat"),
}
# Robots of the study with stops.
OTHER_ROBOTS = (11, 12, 13)


def robot_of(seed: int) -> VirtualRobot:
    """The virtual robot of a seed, cold, with two motions."""
    robot = VirtualRobot(seed, fall=FALL)
    robot.add_motion()
    return robot


def trained(folder: Path, seed: int) -> dict[str, Baseline]:
    """The plain and the thermal model of a robot, identified from a warm-up campaign, kept in the folder."""
    file = folder / f"robot{seed}.json"
    if not file.exists():
        robot = robot_of(seed)
        with tempfile.TemporaryDirectory() as place:
            described = load_robot(str(write_description(robot.machine, Path(place))))
        logs: list[Log] = []
        for k in range(12):
            logs.append(robot.log(LOGGED, k % 2, f"cycle {k}"))
            robot.warm_up(210.0)
            robot.rest(REST)
        for k in range(4):
            robot.rest(600.0)
            logs.append(robot.log(30.0, k % 2, f"cooling {k}"))
        plain = identify(described, [*logs[:2], *logs[10:12]], friction="polynomial").model
        thermal = fit_campaign(described, logs, order="second", model=plain).torque_model
        file.write_text(json.dumps({"plain": plain.to_dict(), "thermal": thermal.to_dict()}))
    data = json.loads(file.read_text())
    return {name: baseline_of(model_from_dict(content), content) for name, content in data.items()}


def cycle(robot: VirtualRobot, number: int, motions: Sequence[int] = (0, 1)) -> Log:
    """A cycle of 5 min with one of the motions. Its first minute is logged."""
    log = robot.log(LOGGED, motions[number % len(motions)], f"cycle {number}")
    robot.warm_up(CYCLE - LOGGED - REST)
    robot.rest(REST)
    return log


def send(monitors: Sequence[Monitor], log: Log) -> None:
    """Gives a log to all monitors."""
    for monitor in monitors:
        monitor.begin(log.name)
        monitor.update(log.t, log.q, log.tau)  # type: ignore[arg-type]


def monitors_of(models: dict[str, Baseline], study: str = "thesis") -> dict[str, Monitor]:
    """One monitor per variant of a study."""
    return {
        name: Monitor(models[model], MonitorSettings(heat=heat))  # type: ignore[arg-type]
        for name, (model, heat) in VARIANTS.items()
        if name in STUDIED[study]
    }


def thesis(folder: Path, seed: int, joint: int, *, night: bool = False) -> dict[str, Any]:
    """Two days of 24 cycles; the damage comes 60 min into the second, or in the night before it."""
    models, robot = trained(folder, seed), robot_of(seed)
    robot.rng = np.random.default_rng([seed, joint])
    robot.rest(DAY / 2)
    monitors = monitors_of(models)
    begin = robot.clock
    moment = begin + DAY + (-3600.0 if night else 12 * CYCLE + 30.0)
    robot.causes = [Cause(kind="damage", time=moment, joint=joint, amount=DAMAGE)]
    for _ in range(2):
        start = robot.clock
        for k in range(24):
            send(list(monitors.values()), cycle(robot, k))
        robot.rest(DAY - (robot.clock - start))
    found = {}
    for name, monitor in monitors.items():
        monitor.finish()
        right = [f for f in monitor.findings if f.kind == "damage" and f.joint == joint and f.latest >= moment]
        others = [f for f in monitor.findings if f.severity != "info" and not any(f is r for r in right[:1])]
        first = right[0] if right else None
        table = monitor.evaluation.history.table()["friction"]
        found[name] = {
            "delay": None if first is None else first.detected - max(moment, begin + DAY),
            "dated": None if first is None else bool(first.earliest <= moment <= first.latest),
            "width": None if first is None else first.latest - first.earliest,
            "size": None if first is None else first.size,
            "covered": None if first is None else bool(first.low <= 100 * DAMAGE <= first.high),
            "false": [f.sentence(begin) for f in others],
            "heat": float(np.median(100 * np.expm1(np.nanmax(table[:144], 0) - np.nanmin(table[:144], 0)))),
        }
    return found


def start(folder: Path, number: int) -> dict[str, Any]:
    """Three logs of a minute, 5 min apart; every second robot is damaged before the first one."""
    rng = np.random.default_rng([number, 91])
    seed, damaged = ROBOTS[number // 20 % len(ROBOTS)], number % 2 == 1
    models, robot = trained(folder, seed), robot_of(seed)
    robot.rng = np.random.default_rng([seed, number])
    robot.swing = float(rng.uniform(0.0, 6.0))
    motions = [robot.add_motion() for _ in range(2)] if number % 4 > 1 else [0, 1]
    robot.rest(float(rng.uniform(0.2, 1.0)) * DAY)
    robot.warm_up(float(rng.choice([0.0, 300.0, 1800.0])))
    joint = int(rng.integers(1, robot.n + 1))
    if damaged:
        robot.causes = [Cause(kind="damage", time=robot.clock - 1.0, joint=joint, amount=0.3)]
    monitors, begin = monitors_of(models, "start"), robot.clock
    for k in range(3):
        send(list(monitors.values()), robot.log(LOGGED, motions[k % 2], f"log {k}"))
        robot.warm_up(CYCLE - LOGGED - REST)
        robot.rest(REST)
    row: dict[str, Any] = {"seed": seed, "damaged": damaged, "joint": joint}
    for name, monitor in monitors.items():
        monitor.finish()
        found = [f for f in monitor.findings if f.severity != "info"]
        right = [f for f in found if f.kind == "damage" and f.joint == joint and damaged]
        row[name] = {
            "found": bool(right),
            "covered": [f.low <= 30.0 <= f.high for f in right[:1]],
            "false": [f.sentence(begin) for f in found if f not in right],
            "act": sum(f.severity == "act" for f in found if f not in right),
        }
    return row


def healthy(folder: Path, seed: int, hours: float = 100.0) -> dict[str, Any]:
    """Two hours of cycles, two hours of rest, again and again."""
    models, robot = trained(folder, seed), robot_of(seed)
    robot.rng = np.random.default_rng([seed, 100])
    robot.rest(DAY / 2)
    monitors = monitors_of(models, "healthy")
    begin = robot.clock
    number = 0
    while robot.clock - begin < hours * 3600:
        for _ in range(24):
            send(list(monitors.values()), cycle(robot, number))
            number += 1
        robot.rest(2 * 3600.0)
    for monitor in monitors.values():
        monitor.finish()
    return {
        "hours": (robot.clock - begin) / 3600,
        "motion": number * LOGGED / 3600,
        **{name: [f.sentence(begin) for f in m.findings if f.severity != "info"] for name, m in monitors.items()},
    }


def week(folder: Path, number: int, *, stops: bool = False) -> dict[str, Any]:
    """Five days of six cycles with a random cause, or two, or none. `stops`: logs of moves from point to point."""
    rng = np.random.default_rng([number, 7])
    seed = OTHER_ROBOTS[number % len(OTHER_ROBOTS)] if stops else ROBOTS[number // 20 % len(ROBOTS)]
    models, robot = trained(folder, seed), robot_of(seed)
    robot.rng = np.random.default_rng([seed, number])
    motions = [robot.add_moves(LOGGED) for _ in range(3)] if stops else [0, 1]
    robot.swing = float(rng.uniform(0.0, 6.0))
    robot.rest(float(rng.uniform(0.2, 1.0)) * DAY)
    begin = robot.clock
    kind, moment, causes = draw_causes(rng, begin, robot.n, CYCLE)
    robot.causes = causes
    monitors = monitors_of(models, "stops" if stops else "weeks")
    for _ in range(5):
        start = robot.clock
        for k in range(6):
            send(list(monitors.values()), cycle(robot, k, motions))
        robot.rest(DAY - (robot.clock - start))
    truth = sorted((cause.kind, cause.joint) for cause in causes)
    row: dict[str, Any] = {
        "kind": kind,
        "causes": [[c.kind, c.joint, c.amount, c.time - begin] for c in causes],
        "seed": seed,
    }
    for name, monitor in monitors.items():
        monitor.finish()
        found = [f for f in monitor.findings if f.severity != "info"]
        named = sorted({(f.kind, f.joint or 0) for f in found})
        row[name] = {
            "right": [tuple(item) for item in named] == truth,
            "found": [f.sentence(begin) for f in found],
            "dated": [bool(f.earliest <= moment <= f.latest) for f in found],
            "sizes": [size_of(f, causes) for f in found if size_of(f, causes) is not None],
            "findings": [f.to_dict(begin) for f in found],
        }
    return row


def speed(folder: Path) -> dict[str, Any]:
    """Follows 20 min of a stream in chunks of 1 s, and gives the time that it took."""
    models, robot = trained(folder, ROBOTS[0]), robot_of(ROBOTS[0])
    log = robot.log(1200.0)
    assert log.tau is not None
    rows = {}
    for name, monitor in monitors_of(models).items():
        monitor.update(log.t[:10000], log.q[:10000], log.tau[:10000])  # compiles the model
        start = time.perf_counter()
        for k in range(10000, len(log), 250):
            part = slice(k, k + 250)
            monitor.update(log.t[part], log.q[part], log.tau[part])
        spent = time.perf_counter() - start
        rows[name] = float(log.t[-1] - log.t[10000]) / spent
    return rows


def run(folder: Path, study: str, count: int) -> None:
    """Adds rows to the study's file until there are `count`."""
    file = folder / f"{study}.jsonl"
    done = {json.loads(line)["key"] for line in file.read_text().splitlines()} if file.exists() else set()
    for number in range(count):
        if str(number) in done:
            continue
        began = time.perf_counter()
        if study in ("thesis", "night"):
            row = thesis(folder, ROBOTS[number // 6 % len(ROBOTS)], number % 6 + 1, night=study == "night")
        elif study == "start":
            row = start(folder, number)
        elif study == "healthy":
            row = healthy(folder, ROBOTS[number % len(ROBOTS)])
        elif study in ("weeks", "stops"):
            row = week(folder, number, stops=study == "stops")
        else:
            row = speed(folder)
        row = {"key": str(number), "seconds": time.perf_counter() - began, **row}
        with file.open("a") as stream:
            stream.write(json.dumps(row) + "\n")
        print(f"{study} {number}: {row['seconds']:.0f} s", flush=True)


def main() -> int:
    warnings.simplefilter("ignore")
    if len(sys.argv) < 2:
        print(__doc__)
        return 2
    folder, study = Path(sys.argv[1]), sys.argv[2] if len(sys.argv) > 2 else "table"
    folder.mkdir(parents=True, exist_ok=True)
    counts = {"thesis": 6, "night": 6, "start": 100, "healthy": 1, "weeks": 200, "stops": 60, "speed": 1}
    if study == "table":
        print_table(folder, list(VARIANTS), cycle=CYCLE, damage=DAMAGE)
        return 0
    if study not in counts:
        print(f"unknown study {study}; one of {', '.join(counts)}, table")
        return 2
    run(folder, study, int(sys.argv[3]) if len(sys.argv) > 3 else counts[study])
    return 0


if __name__ == "__main__":
    sys.exit(main())
