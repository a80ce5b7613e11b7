"""The verb `answer_benchmark`: one of the methods here answers all cases."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from oed.benchmarks.answers.answer import Answers, CaseAnswer
from oed.benchmarks.answers.entries import case_answer
from oed.benchmarks.answers.files import FILE, plain_case, write_answers
from oed.benchmarks.by_diagnosis import by_diagnosis
from oed.benchmarks.folders import Benchmark, BlindCase, read_benchmark
from oed.benchmarks.rivals.residual_fit import by_residual_fit
from oed.benchmarks.rivals.threshold import by_threshold
from robots.common.errors import InputError, OedError
from robots.common.files import ResultFolder, write_atomic
from robots.common.parallel import parallel_map
from robots.common.progress import Progress
from robots.common.records import Record
from robots.version import VERSION

METHODS: dict[str, Callable[[BlindCase], CaseAnswer]] = {
    "oed": by_diagnosis,
    "residual-fit": by_residual_fit,
    "threshold": by_threshold,
}
"""Methods by name."""

PARTS = ".parts"
"""Folder of the answers so far, by which an interrupted run goes on."""


@dataclass(frozen=True, kw_only=True)
class Answered(Record):
    """What `answer_benchmark` did.

    Attributes:
        answers: of all cases that could be answered.
        refused: reasons of the others, by case.
        resumed: number of cases that an earlier run had answered.
    """

    ENTRIES = (
        "tool=answers.tool",
        "version=answers.version",
        "benchmark=answers.benchmark",
        "cases=plain_cases",
        "refused",
        "resumed",
    )

    answers: Answers
    refused: dict[str, str]
    resumed: int

    @property
    def plain_cases(self) -> dict[str, Any]:
        """The answers, without the predictions."""
        return {name: plain_case(answer) for name, answer in self.answers.cases.items()}

    def summary(self) -> str:
        """Says how many cases were answered, and how."""
        counts: dict[str, int] = {}
        for answer in self.answers.cases.values():
            counts[answer.verdict] = counts.get(answer.verdict, 0) + 1
        said = ", ".join(f"{count} {verdict}" for verdict, count in sorted(counts.items()))
        lines = [f"{self.answers.tool}: {len(self.answers.cases)} cases answered: {said or 'none'}"]
        if self.resumed:
            lines.append(f"{self.resumed} of them by an earlier run")
        lines += [f"{name} not answered: {reason}" for name, reason in self.refused.items()]
        return "\n".join(lines)


def answer_benchmark(
    folder: str | PathLike[str],
    *,
    by: str,
    out: str | PathLike[str],
    force: bool = False,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Answered:
    """Answers a benchmark by one of the methods, and writes the file of answers.

    A run that was interrupted goes on where it was, if it is started again with the same folders.

    Args:
        folder: the benchmark.
        by: a key of `METHODS`.
        out: folder for ``answers.json`` and the predictions.
        force: whether existing answers may be replaced; all cases are then answered anew.
        workers: number of processes; None for one per core.
        progress: receives the number of answered cases.

    Returns:
        The answers, as they were written.

    Raises:
        InputError: an unknown method; a folder that is no benchmark; existing answers.
    """
    if by not in METHODS:
        raise InputError(f"no method is called {by!r}", allowed=", ".join(METHODS))
    benchmark, out = read_benchmark(folder), Path(out)
    if force:
        shutil.rmtree(out / PARTS, ignore_errors=True)
    elif (out / FILE).exists():
        raise InputError("the file exists", file=out / FILE, remedy="use force (--force) to answer all cases anew")
    parts = out / PARTS / f"{by}-{benchmark.identity}"
    parts.mkdir(parents=True, exist_ok=True)
    todo = [name for name in benchmark.cases if not (parts / f"{name}.json").exists()]
    parallel_map(
        partial(_answer, benchmark, by, parts), todo, workers=workers, progress=progress, task="answering cases"
    )
    found, refused = {}, {}
    for name in benchmark.cases:
        answer, reason = _read_part(parts, benchmark.case(name))
        if answer is None:
            refused[name] = reason
        else:
            found[name] = answer
    answers = Answers(tool=by, version=VERSION, benchmark=benchmark.identity, cases=found, file=out / FILE)
    with ResultFolder(out, force, names=[FILE]) as results:
        write_answers(results, answers)
    shutil.rmtree(out / PARTS, ignore_errors=True)
    return Answered(answers=answers, refused=refused, resumed=len(benchmark.cases) - len(todo))


def _answer(benchmark: Benchmark, by: str, parts: Path, name: str) -> None:
    """Answers a case and keeps the answer: prediction first, so that an entry is complete."""
    try:
        answer = METHODS[by](benchmark.case(name))
    except OedError as error:
        write_atomic(parts / f"{name}.json", json.dumps({"refused": str(error)}), force=True)
        return
    if answer.torque is not None:
        np.save(parts / f"{name}.npy", answer.torque)
    write_atomic(parts / f"{name}.json", json.dumps(plain_case(answer), allow_nan=False), force=True)


def _read_part(parts: Path, case: BlindCase) -> tuple[CaseAnswer | None, str]:
    file = parts / f"{case.name}.json"
    entry = json.loads(file.read_text(encoding="utf-8"))
    if "refused" in entry:
        return None, entry["refused"]
    answer, _ = case_answer(entry, case.joints, file, case.name)
    torque = parts / f"{case.name}.npy"
    return CaseAnswer(
        verdict=answer.verdict, effects=answer.effects, torque=np.load(torque) if torque.exists() else None
    ), ""
