"""Thousands of mangled logs: each ends in one clear message, in a right result, or in a result that is said to suffer.

A virtual arm of two joints is logged, the log is spoilt by one or two of the ways in `mangled_parts`, written in one of
seven formats, and goes through reader, gate and identification. Result of a case:

- ``message``: one of our errors, and nothing else;
- ``right``: each parameter within five standard errors of the truth, or wrong by less than matters;
- ``reported``: a result that is not right, with a warning of the gate or marked parameters that say so;
- ``silent``: a wrong result without a word; ``traceback``: any other exception. Neither may happen.

    python benchmarks/mangled_logs.py --cases 10000 --seed 0 --workers 2 --out mangled.jsonl
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import shutil
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks.mangled_parts.content import BYTES, TEXT
from benchmarks.mangled_parts.formats import FORMATS, write
from benchmarks.mangled_parts.values import VALUES
from estimation import identify, read_log
from estimation.identifications.choices import Candidates
from robots.base_parameters import find_base_parameters
from robots.common.errors import OedError
from robots.geometry.chain import Chain, Joint
from robots.limits import Limits
from robots.plants import Plant, Sensors, nominal_plant, simulate
from robots.robot import Robot
from robots.signals import Motion

# A parameter is right within so many standard errors of the truth, or when its error makes less than this share of the
# torque.
ERRORS, MATTERS = 5.0, 0.05
# Fewer than by default: the logs are short, and it is not the choice of the smoothing that is tested.
CANDIDATES = Candidates(cutoffs=(3.0, 8.0, 20.0), blocks=6)


@dataclass(frozen=True)
class Case:
    """What was done to a log and what came of it."""

    number: int
    kind: str
    ways: tuple[str, ...]
    result: str
    detail: str
    seconds: float


@cache
def arm() -> Robot:
    """Two joints about horizontal axes."""
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    axis = np.array([0.0, 0.0, 1.0])
    joints = (
        Joint("J1", "revolute", turn, np.zeros(3), axis),
        Joint("J2", "revolute", np.eye(3), np.array([0.4, 0, 0]), axis),
    )
    two = np.ones(2)
    return Robot(
        name="arm",
        chain=Chain(joints),
        limits=Limits(
            lower=-2 * two, upper=2 * two, velocity=4 * two, acceleration=30 * two, jerk=500 * two, torque=100 * two
        ),
        inertia=np.array(
            [[4.0, 0.8, 0.0, 0.0, 0.02, 0.0, 0.0, 0.3, 0.0, 0.3], [2.0, 0.3, 0.1, 0.0, 0.01, 0.0, 0.0, 0.1, 0.0, 0.1]]
        ),
        rotor_inertia=np.array([0.2, 0.1]),
        friction=np.array([[2.0, 1.5, 0.0, 0.0], [1.0, 0.8, 0.0, 0.0]]),
        gear_ratio=100 * two,
    )


@cache
def plant() -> Plant:
    """The arm with some noise."""
    return nominal_plant(arm(), friction="coulomb-viscous", sensors=Sensors(torque_noise=0.02))


def motion(seed: int, duration: float = 10.0, period: float = 0.01) -> Motion:
    """Five harmonics of 0.2 Hz within 0.8 of the range."""
    rng = np.random.default_rng(seed)
    t = period * np.arange(round(duration / period))
    w = 2 * np.pi * 0.2 * np.arange(1, 6)
    a, b = rng.normal(size=(2, 5, 2))
    s, c = np.sin(np.outer(t, w)), np.cos(np.outer(t, w))
    q, dq, ddq = s @ (a / w[:, None]) - c @ (b / w[:, None]), c @ a + s @ b, c @ (b * w[:, None]) - s @ (a * w[:, None])
    scale = np.minimum(3.2 / np.ptp(q, axis=0), 3.0 / np.abs(dq).max(axis=0))
    return Motion(t=t, q=scale * q, dq=scale * dq, ddq=scale * ddq)


def good_log(seed: int) -> dict[str, np.ndarray]:
    """The columns of a log that nothing is wrong with."""
    log = simulate(plant(), motion(seed), seed=seed)
    columns = {"t": log.t}
    for prefix, values in (("q", log.q), ("tau", log.tau)):
        assert values is not None
        columns |= {f"{prefix}{joint + 1}": values[:, joint].copy() for joint in range(2)}
    return columns


def run_case(number: int, seed: int, folder: Path) -> Case:
    """Mangles one log and sees what comes of it."""
    start = time.process_time()
    rng = np.random.default_rng((seed, number))
    kind = str(rng.choice(FORMATS, p=[0.4, 0.15, 0.1, 0.1, 0.1, 0.05, 0.1]))
    columns = good_log(int(rng.integers(0, 20)))
    ways: list[str] = []
    for _ in range(int(rng.choice([0, 1, 2], p=[0.35, 0.5, 0.15]))):
        way = VALUES[int(rng.integers(len(VALUES)))]
        try:
            with np.errstate(all="ignore"):
                columns = way(columns, rng)
        except (KeyError, ValueError, IndexError):
            continue  # an earlier way has taken away what this one works on
        ways.append(way.__name__)
    place = folder / str(number)
    place.mkdir()
    try:
        path = write(columns, kind, place)
        of_bytes = (*BYTES, *TEXT, *TEXT) if kind == "csv" else BYTES
        if not ways or rng.random() < 0.1:
            change = of_bytes[int(rng.integers(len(of_bytes)))]
            data = path.read_bytes()
            if data:
                path.write_bytes(change(data, rng))
                ways.append(change.__name__)
        result, detail = judge(path)
    finally:
        shutil.rmtree(place)
    return Case(number, kind, tuple(ways), result, detail, time.process_time() - start)


def judge(path: Path) -> tuple[str, str]:
    """Reads, checks and identifies a log; says what came of it."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            log = read_log(path, 2, joints=arm().joint_names)
            estimate = identify(arm(), log, friction="coulomb-viscous", candidates=CANDIDATES)
    except OedError as error:
        text = str(error)
        # A mapping that would fit is printed line by line.
        clear = len(text) > 10 and ("\n" not in text or "mapping" in text)
        return ("message", text[:300]) if clear else ("traceback", f"unclear: {text!r}")
    except Exception:
        return "traceback", traceback.format_exc()[-1500:]
    wrong = wrong_parameters(estimate.model)
    if not wrong:
        return "right", ""
    (report,) = estimate.gates
    said = [str(finding) for finding in report.of("warning")]
    lost = [joint.name for joint in estimate.joints if not joint.identified]
    if said or lost:
        return "reported", "; ".join([*said, *(f"{name} not identified" for name in lost)])[:300]
    return "silent", f"{wrong}; unexplained {np.round(report.unexplained, 3).tolist()}"


def wrong_parameters(model: object) -> list[str]:
    """The determined parameters that are off by more than their errors, and by more than matters."""
    base = find_base_parameters(model.torque_model)  # type: ignore[attr-defined]
    truth = base.from_standard(_standard(base.model.names))
    errors = np.sqrt(np.maximum(np.diag(model.covariance), 0.0))  # type: ignore[attr-defined]
    off = np.abs(model.values - truth)  # type: ignore[attr-defined]
    test = motion(99)
    columns = base.regressor(test.q, test.dq, test.ddq)
    torque = np.sqrt(np.mean(base.torque(test.q, test.dq, test.ddq, truth) ** 2, axis=0))
    share = (np.sqrt(np.mean(columns**2, axis=0)) * off / torque[:, None]).max(axis=0)
    wrong = model.determined & (off > ERRORS * errors) & (share > MATTERS)  # type: ignore[attr-defined]
    return [f"{base.names[k]} {model.values[k]:.4g} for {truth[k]:.4g}" for k in np.flatnonzero(wrong)]  # type: ignore[attr-defined]


def _standard(names: tuple[str, ...]) -> np.ndarray:
    known = dict(zip(plant().model.names, plant().parameters, strict=True))
    return np.array([known.get(name, 0.0) for name in names])


def _work(job: tuple[int, int, str]) -> Case:
    number, seed, folder = job
    return run_case(number, seed, Path(folder))


def run(cases: int, seed: int, processes: int = 1, first: int = 0) -> Iterator[Case]:
    """Runs so many cases, in order."""
    with tempfile.TemporaryDirectory() as folder:
        jobs = [(number, seed, folder) for number in range(first, first + cases)]
        if processes == 1:
            yield from map(_work, jobs)
            return
        with multiprocessing.Pool(processes) as pool:
            yield from pool.imap(_work, jobs, chunksize=20)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=2, help="number of parallel processes")
    parser.add_argument("--out", type=Path, default=None, help="one JSON object a case")
    options = parser.parse_args()
    done = []
    with options.out.open("w", encoding="utf-8") if options.out else nullcontext() as out:
        for case in run(options.cases, options.seed, options.workers, options.first):
            done.append(case)
            if out is not None:
                print(json.dumps(case.__dict__), file=out, flush=True)
    tally = Counter(case.result for case in done)
    print(f"{len(done)} cases, {sum(case.seconds for case in done):.0f} s of CPU: {dict(tally)}")
    for case in done:
        if case.result in ("silent", "traceback"):
            last = case.detail.strip().splitlines()[-1]
            print(f"case {case.number} ({case.kind}, {', '.join(case.ways)}): {case.result}: {last}")
    return int(bool(tally["silent"] + tally["traceback"]))


if __name__ == "__main__":
    sys.exit(main())
