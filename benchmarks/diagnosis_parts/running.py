"""One case through the diagnosis, and what is kept of it: a row of plain data."""

from __future__ import annotations

import contextlib
import gc
import resource
import tempfile
import time
import traceback
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.diagnosis_parts.followups import follow
from benchmarks.diagnosis_parts.strata import STRATA, Task, draw
from oed.benchmarks.truth.cases import Case
from oed.benchmarks.truth.description import write_description
from oed.benchmarks.truth.oracle import ask_oracle
from oed.benchmarks.truth.plant import Record
from robots import load_robot
from robots.common.errors import AssumedValueWarning, OedError
from robots.common.workers import give_back
from robots.robot import Robot
from robots.signals import Log


def run(task: Task) -> dict[str, Any]:
    """Draws a case, diagnoses it, follows its advice where it is ambiguous; a failure is kept as a row, too."""
    warnings.simplefilter("ignore", AssumedValueWarning)
    row: dict[str, Any] = {"key": task.key, "stratum": task.stratum, "seed": task.seed}
    try:
        case = draw(task)
    except Exception:
        return {**row, "status": "failed", "error": traceback.format_exc()}
    if case is None:
        return {**row, "status": "hidden"}
    row |= truth_of(case)
    with described(case, STRATA[task.stratum].drives) as robot:
        try:
            diagnosis, reported = diagnose_case(case, robot)
            row |= reported
            if row["verdict"] == "ambiguous" and row["stratum"] in ("half", "one", "brief"):
                row["after"] = follow(case, robot, diagnosis)
        except OedError as error:
            return {**row, "status": "refused", "error": str(error)}
        except Exception:
            return {**row, "status": "failed", "error": traceback.format_exc()}
    return {**row, "status": "done"}


def forget_peak() -> None:
    """Lets the system count this process's largest memory from now on (Linux only).

    The plant's own may be larger, and what a case before left is given back.
    """
    gc.collect()
    give_back()
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")


def peak_memory() -> float:
    """The largest memory [MB] of this process since the peak was forgotten, or since it began."""
    status = Path("/proc/self/status")
    if status.exists():
        lines = dict(line.split(":", 1) for line in status.read_text(encoding="ascii").splitlines())
        return int(lines["VmHWM"].split()[0]) / 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


@contextlib.contextmanager
def described(case: Case, drives: bool = True) -> Iterator[Robot]:
    """The robot as its maker describes it, read from files as a user has them."""
    with tempfile.TemporaryDirectory() as folder:
        yield load_robot(write_description(case.machine, Path(folder), drives=drives))


def logs_of(records: Sequence[Record]) -> list[Log]:
    """Logs of t, q and tau alone."""
    return [Log(t=record.t, q=record.q, tau=record.tau) for record in records]


def truth_of(case: Case) -> dict[str, Any]:
    """What is true of a case."""
    shown = case.visible() if case.effects else []
    effects = [
        {
            "effect": effect.name,
            "kind": type(effect).__name__,
            "joint": effect.joint,
            "amount": float(effect.amount),
            "visible": share,
            "lasting": effect.lasting,
            "parameters": {name: float(value) for name, value in effect.truths().items()},
        }
        for effect, share in zip(case.effects, shown, strict=True)
    ]
    return {
        "robot": case.machine.name,
        "motion": case.references[0].kind,
        "duration": case.references[0].duration,
        "tails": case.noise.tails is not None,
        "truth": effects,
    }


def diagnose_case(case: Case, robot: Robot) -> tuple[Any, dict[str, Any]]:
    """Diagnoses a case's logs and measures the gain on its unseen ones."""
    from estimation import diagnose

    logs, unseen = logs_of(case.logs), logs_of(case.unseen)
    forget_peak()
    cpu, wall = time.process_time(), time.perf_counter()
    diagnosis = diagnose(robot, logs, held_out=unseen or None)
    row: dict[str, Any] = {
        "cpu": time.process_time() - cpu,
        "wall": time.perf_counter() - wall,
        "memory": peak_memory(),
    }
    said = diagnosis.to_dict()
    row |= {"verdict": said["verdict"], "findings": [_finding(f) for f in said["findings"]]}
    row["next"] = said.get("next_experiment")
    row["limits"] = [
        limit
        for effect in case.effects
        for limit in said.get("limits", [])
        if limit["effect"] == effect.name and limit["joint"] == effect.joint
    ]
    if unseen and case.effects:
        # On the same rows: the diagnosis leaves out ends, where filters err, and rows whose direction it does not know.
        counted = [_counted(diagnosis.trace, log.t) for log in unseen]
        oracle = ask_oracle(case, counted, logged=True)
        squares = [(log.tau**2 * counts).sum(axis=0) for log, counts in zip(unseen, counted, strict=True)]
        size = np.sum(squares, axis=0) / np.sum([counts.sum(axis=0) for counts in counted], axis=0)
        for name in ("before", "after", "as_measured"):
            row[f"oracle_{name}"] = (getattr(oracle, name) / size).tolist()
        reported = [np.square(np.array(said[name]["nrmse"], dtype=float)) for name in ("baseline", "extended")]
        row["before"], row["after_extension"] = reported[0].tolist(), reported[1].tolist()
        row["by_file"] = _by_file(diagnosis, logs, unseen)
    return diagnosis, row


def _by_file(diagnosis: Any, logs: Sequence[Log], unseen: Sequence[Log]) -> list[float]:
    """Squared NRMSE (n,) on rows that count, of what the model that the diagnosis wrote predicts of the unseen logs."""
    from estimation import load_model, predict

    with tempfile.TemporaryDirectory() as folder:
        diagnosis.save(folder)
        model = load_model(folder)
    squares, torques = [], []
    for log in unseen:
        prediction = predict(model, log, before=logs if model.keeps_heat else ())
        counted = _counted(diagnosis.trace, prediction.motion.t)
        squares.append(((prediction.measured - prediction.predicted) ** 2 * counted).sum(axis=0))
        torques.append((prediction.measured**2 * counted).sum(axis=0))
    return (np.sum(squares, axis=0) / np.maximum(np.sum(torques, axis=0), 1e-300)).tolist()


def _counted(trace: Any, t: np.ndarray) -> np.ndarray:
    """Marks the samples (N, n) of an unseen log on which the diagnosis measured its gain, by its curves."""
    nearest = np.clip(np.searchsorted(trace.t, t), 1, len(trace.t) - 1)
    nearest -= t - trace.t[nearest - 1] < trace.t[nearest] - t
    close = np.abs(trace.t[nearest] - t) <= np.median(np.diff(trace.t))
    return np.isfinite(trace.before[nearest]) & close[:, None]


def _finding(finding: dict[str, Any]) -> dict[str, Any]:
    kept = ("effect", "joint", "parameters", "p_value", "delta_bic", "rivals")
    return {name: finding.get(name) for name in kept}
