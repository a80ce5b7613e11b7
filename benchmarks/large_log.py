"""A two-hour campaign: read, checked, filtered and identified, against what the machine's linear algebra could do.

Run it with ``python benchmarks/large_log.py [HOURS [FOLDER]]``. A virtual six-joint arm moves for two hours (1.8
million samples at 250 Hz); its Parquet log is written once. The whole way from the file to the parameters runs in a
process of its own, for a quarter of the time and for all of it: time must grow with the length, and memory must not
hold the regressor (10.8 million rows of 70 columns are 6 GB). Beside it stands the time that one thread of this
machine's BLAS takes for the symmetric product of a dense regressor of that size.

With ``python benchmarks/large_log.py --stream [ROWS ...]`` folders of Parquet parts, of 500,000 rows each, are
identified in pieces. Memory must not grow with the rows.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
from memory import peak_memory
from scipy.linalg.blas import dsyrk

from estimation import identify, read_log, write_log
from estimation.identifications.streams import identify_stream
from estimation.logs.parquet_streams import open_stream
from robots import load_robot, nominal_plant, simulate
from robots.common.errors import AssumedValueWarning
from robots.common.parallel import one_blas_thread
from robots.robot import Robot
from robots.signals import Motion

HOURS, RATE, ROBOT = 2.0, 250.0, "er3a"
TONES = 6
PARAMETERS = 70
PART = 500_000


def motion(robot: Robot, hours: float, seed: int = 0) -> Motion:
    """Draws six tones a joint, of frequencies without a common period, within the limits."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(3600 * hours * RATE)) / RATE
    w = 2 * np.pi * rng.uniform(0.05, 0.5, (TONES, robot.n))
    phase, a = rng.uniform(0, 2 * np.pi, (TONES, robot.n)), rng.normal(size=(TONES, robot.n))
    q, dq, ddq = np.zeros((3, len(t), robot.n))
    for tone in range(TONES):
        angle = t[:, None] * w[tone] + phase[tone]
        q += a[tone] / w[tone] * np.sin(angle)
        dq += a[tone] * np.cos(angle)
        ddq -= a[tone] * w[tone] * np.sin(angle)
    lower, upper = np.maximum(robot.limits.lower, -np.pi), np.minimum(robot.limits.upper, np.pi)
    scale = np.minimum(0.9 * (upper - lower) / np.ptp(q, axis=0), 0.7 * robot.limits.velocity / np.abs(dq).max(axis=0))
    middle = (lower + upper) / 2 - scale * (q.max(axis=0) + q.min(axis=0)) / 2
    return Motion(t=t, q=scale * q + middle, dq=scale * dq, ddq=scale * ddq)


def write(path: Path, hours: float) -> None:
    """Simulates a log and writes it."""
    plant = nominal_plant(load_robot(ROBOT), spread=0.1, seed=1)
    write_log(path, simulate(plant, motion(plant.robot, hours), seed=1), force=True)


def run(path: Path) -> dict[str, float]:
    """Reads and identifies, in this process: times [s] of the clock and of all threads, and peak memory [GB]."""
    robot = load_robot(ROBOT)
    clock, cpu = time.perf_counter(), time.process_time()
    estimate = identify(robot, read_log(path, n=robot.n))
    return {
        "wall": time.perf_counter() - clock,
        "cpu": time.process_time() - cpu,
        "memory": peak_memory(),
        "samples": float(len(estimate.t)),
        "identified": float(sum(joint.identified for joint in estimate.joints)),
    }


def product_speed(rows: int = 60_000) -> float:
    """Speed of one thread's symmetric product Y'Y of a dense regressor [GFLOP/s]."""
    Y = np.asfortranarray(np.random.default_rng(0).normal(size=(PARAMETERS, rows)))
    best = np.inf
    with one_blas_thread():
        for _ in range(5):
            start = time.perf_counter()
            dsyrk(1.0, Y)
            best = min(best, time.perf_counter() - start)
    return rows * PARAMETERS * (PARAMETERS + 1) / best / 1e9


def write_part(path: Path, number: int, rows: int) -> None:
    """Simulates a part of a long log: another motion, a minute after the part before."""
    plant = nominal_plant(load_robot(ROBOT), spread=0.1, seed=1)
    moved = motion(plant.robot, rows / RATE / 3600, seed=number)
    log = simulate(plant, moved, seed=number)
    write_log(path, replace(log, t=log.t + number * (PART / RATE + 60.0)), force=True)


def run_stream(folder: Path) -> dict[str, float]:
    """Identifies a folder of parts in this process: time of the clock [s], peak memory [GB]."""
    robot = load_robot(ROBOT)
    clock = time.perf_counter()
    stream = open_stream(folder, robot.n)
    estimate = identify_stream(robot, stream)
    truth = nominal_plant(robot, spread=0.1, seed=1)
    moved = motion(robot, 0.02, seed=10_000)
    torque = truth.model.torque(moved.q, moved.dq, moved.ddq, truth.parameters)
    error = estimate.model.torque(moved.q, moved.dq, moved.ddq) - torque
    return {
        "rows": float(len(stream)),
        "wall": time.perf_counter() - clock,
        "memory": peak_memory(),
        "worst_error": float(np.max(np.sqrt(np.mean(error**2, axis=0) / np.mean(torque**2, axis=0)))),
    }


def streams(sizes: list[int]) -> int:
    """Measures time and peak memory of logs of some sizes, each a folder that grows into the next."""
    with tempfile.TemporaryDirectory() as scratch:
        made = 0
        for rows in sorted(sizes):
            for number in range(made, -(-rows // PART)):
                write_part(Path(scratch) / f"part_{number:04}.parquet", number, PART)
                made += 1
            command = [sys.executable, str(Path(__file__).resolve()), "--run-stream", scratch]
            output = subprocess.run(command, capture_output=True, text=True, check=True, env=dict(os.environ))
            found = json.loads(output.stdout.splitlines()[-1])
            print(
                f"{found['rows']:.0f} rows: {found['wall']:.1f} s by the clock, {found['memory']:.2f} GB; "
                f"{found['rows'] / found['wall']:.0f} rows per second; on an unseen motion at most "
                f"{100 * found['worst_error']:.3f} % of a joint's torque from the truth",
                flush=True,
            )
    return 0


def main() -> int:
    if sys.argv[1:2] == ["--run-stream"]:
        warnings.simplefilter("ignore", AssumedValueWarning)
        print(json.dumps(run_stream(Path(sys.argv[2]))))
        return 0
    if sys.argv[1:2] == ["--stream"]:
        warnings.simplefilter("ignore", AssumedValueWarning)
        return streams([int(float(size)) for size in sys.argv[2:]] or [1_000_000, 10_000_000])
    if sys.argv[1:2] == ["--run"]:
        warnings.simplefilter("ignore", AssumedValueWarning)
        print(json.dumps(run(Path(sys.argv[2]))))
        return 0
    warnings.simplefilter("ignore", AssumedValueWarning)
    hours = float(sys.argv[1]) if len(sys.argv) > 1 else HOURS
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(sys.argv[2]) if len(sys.argv) > 2 else Path(scratch)
        results = {}
        for length in (hours / 4, hours):
            path = folder / f"campaign_{length:g}h.parquet"
            if not path.exists():
                write(path, length)
            command = [sys.executable, str(Path(__file__).resolve()), "--run", str(path)]
            output = subprocess.run(command, capture_output=True, text=True, check=True, env=dict(os.environ))
            results[length] = json.loads(output.stdout.splitlines()[-1])
    speed = product_speed()
    joints = load_robot(ROBOT).n
    print(f"{ROBOT}, {RATE:g} Hz; the symmetric product runs at {speed:.1f} GFLOP/s on one thread")
    for length, result in results.items():
        samples = result["samples"]
        dense = samples * joints * PARAMETERS * (PARAMETERS + 1) / (speed * 1e9)
        print(
            f"{length:g} h, {samples:.0f} samples: {result['wall']:.1f} s by the clock, {result['cpu']:.1f} s of "
            f"processors, {result['memory']:.2f} GB; {samples / result['wall']:.0f} samples per second; "
            f"dense least squares alone {dense:.1f} s, {100 * dense / result['cpu']:.0f} % of the processors' time"
        )
    short, whole = (results[length] for length in sorted(results))
    growth = (whole["cpu"] / short["cpu"]) / (whole["samples"] / short["samples"])
    print(f"time per sample of the whole over that of a quarter: {growth:.2f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
