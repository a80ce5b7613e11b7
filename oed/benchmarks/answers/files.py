"""Files of answers: JSON, with the predicted torques as CSV beside it."""

from __future__ import annotations

import json
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from oed.benchmarks.answers.answer import Answers, Array, CaseAnswer, NamedEffect
from oed.benchmarks.answers.entries import case_answer
from oed.benchmarks.folders import BENCHMARK_VERSION, Benchmark, BlindCase, read_columns
from robots.common.errors import InputError
from robots.common.files import ResultFolder
from robots.common.records import read_json

FORM = "oed-benchmark-answers"
FILE = "answers.json"


def read_answers(path: str | PathLike[str], benchmark: Benchmark) -> Answers:
    """Reads and checks the answers of a tool.

    Args:
        path: the JSON file, or a folder with ``answers.json``.
        benchmark: what they answer.

    Raises:
        InputError: answers of another benchmark; an entry that is missing, unknown or of a wrong kind; a case that the
            benchmark does not have; a prediction of a wrong length, or with values that are not finite.
    """
    file = Path(path)
    file = file / FILE if file.is_dir() else file
    data = read_json(file, FORM, BENCHMARK_VERSION, remedy="write them as docs/benchmark.md says")
    unknown = [key for key in data if key not in ("format", "format_version", "benchmark", "tool", "cases")]
    if unknown:
        raise InputError(f"unknown key {unknown[0]}", file=file, allowed="benchmark, tool, cases")
    identity = data.get("benchmark")
    if identity != benchmark.identity:
        raise InputError(
            f"answers another benchmark ({identity})",
            file=file,
            column="benchmark",
            allowed=f"{benchmark.identity}, the id in {benchmark.folder / 'benchmark.json'}",
        )
    tool = data.get("tool")
    if not isinstance(tool, dict) or not isinstance(tool.get("name"), str) or not tool["name"].strip():
        raise InputError(f"found {tool!r}", file=file, column="tool", allowed='{"name": "...", "version": "..."}')
    cases = data.get("cases")
    if not isinstance(cases, dict):
        raise InputError(
            f"found {type(cases).__name__}", file=file, column="cases", allowed="an object with one entry per case"
        )
    for name in cases:
        if name not in benchmark.cases:
            raise InputError(
                f"the benchmark has no such case; it has {len(benchmark.cases)}",
                file=file,
                column=f"cases.{name}",
                allowed=f"{benchmark.cases[0]} to {benchmark.cases[-1]}",
            )
    return Answers(
        tool=tool["name"].strip(),
        version=str(tool.get("version", "")),
        benchmark=benchmark.identity,
        cases={name: _case(entry, benchmark.case(name), file) for name, entry in cases.items()},
        file=file,
    )


def _case(entry: Any, case: BlindCase, file: Path) -> CaseAnswer:
    place = f"cases.{case.name}"
    answer, prediction = case_answer(entry, case.joints, file, place)
    if prediction is None:
        return answer
    torque = _prediction(file.parent / prediction, case)
    return CaseAnswer(verdict=answer.verdict, effects=answer.effects, torque=torque)


def _prediction(file: Path, case: BlindCase) -> Array:
    names = [f"tau{j + 1}" for j in range(case.joints)]
    torque = read_columns(file, names)
    if len(torque) != case.unseen_rows:
        raise InputError(
            f"{len(torque)} rows",
            file=file,
            allowed=f"{case.unseen_rows}, one per row of {case.name}/unseen.csv, in its order",
        )
    wrong = np.argwhere(~np.isfinite(torque))
    if len(wrong):
        row, column = wrong[0]
        raise InputError(
            f"{torque[row, column]} is not a finite number",
            file=file,
            column=names[column],
            row=int(row) + 2,
            remedy="predict every row, or leave out the prediction",
        )
    return torque


def write_answers(out: ResultFolder, answers: Answers) -> None:
    """Writes answers into an open folder: answers.json, and a CSV per predicted torque.

    Args:
        out: the folder.
        answers: what to write.
    """
    entries = {}
    for name, answer in answers.cases.items():
        entries[name] = plain_case(answer)
        if answer.torque is not None:
            entries[name]["predicted_torque"] = f"predictions/{name}.csv"
            header = ",".join(f"tau{j + 1}" for j in range(answer.torque.shape[1]))
            path = out.path(f"predictions/{name}.csv")
            np.savetxt(path, answer.torque, delimiter=",", header=header, comments="", fmt="%.9g")
    data = {
        "format": FORM,
        "format_version": BENCHMARK_VERSION,
        "benchmark": answers.benchmark,
        "tool": {"name": answers.tool, "version": answers.version},
        "cases": entries,
    }
    out.path(FILE).write_text(json.dumps(data, indent=2, allow_nan=False) + "\n", encoding="utf-8")


def plain_case(answer: CaseAnswer) -> dict[str, Any]:
    """Gives an answer as plain data, without its prediction."""
    return {"verdict": answer.verdict, "effects": [_plain_effect(effect) for effect in answer.effects]}


def _plain_effect(effect: NamedEffect) -> dict[str, Any]:
    data: dict[str, Any] = {"effect": effect.effect, "joints": list(effect.joints)}
    if effect.parameters:
        data["parameters"] = {
            name: {"value": stated.value} | ({"interval": list(stated.interval)} if stated.interval else {})
            for name, stated in effect.parameters.items()
        }
    if effect.confidence is not None:
        data["confidence"] = effect.confidence
    return data
