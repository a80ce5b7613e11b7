"""The verb `score_benchmark`: answers of one or more tools against the sealed truth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from oed.benchmarks.answers.answer import Answers
from oed.benchmarks.answers.files import read_answers
from oed.benchmarks.folders import default_sealed, read_benchmark
from oed.benchmarks.scores.judging import Judgement
from oed.benchmarks.scores.rates import Mean, Median, Rate, median, rate
from oed.benchmarks.sealing import unseal
from robots.common.errors import InputError
from robots.common.records import Record

Figures = Mapping[str, Rate | Median | Mean]


@dataclass(frozen=True, kw_only=True)
class ToolScore:
    """The score of one tool.

    Attributes:
        tool: its name, as in the table.
        figures: rates and medians by their titles.
        missing: cases without an answer; they count as wrong.
        unpredicted: number of cases without a predicted torque.
    """

    tool: str
    figures: Figures
    missing: tuple[str, ...]
    unpredicted: int


@dataclass(frozen=True, kw_only=True)
class Scores(Record):
    """Scores of tools, side by side.

    Attributes:
        benchmark: its identity.
        cases: number of its cases.
        tools: one score each.
    """

    benchmark: str
    cases: int
    tools: tuple[ToolScore, ...]

    def rows(self) -> list[tuple[str, ...]]:
        """Lists the rows of the table: title, and one cell per tool."""
        return [
            (title, *(tool.figures[title].text() if title in tool.figures else "-" for tool in self.tools))
            for title in dict.fromkeys(title for tool in self.tools for title in tool.figures)
        ]

    def summary(self) -> str:
        """Writes the table for a terminal."""
        rows = [("", *(tool.tool for tool in self.tools)), *self.rows()]
        widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
        lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
        lines.append(f"benchmark {self.benchmark}, {self.cases} cases; intervals at 95 %")
        return "\n".join([*lines, *self.remarks()])

    def markdown(self) -> str:
        """Writes the table as Markdown."""
        head = ["", *(tool.tool.replace("|", "\\|") for tool in self.tools)]
        lines = [f"| {' | '.join(head)} |", f"|{'---|' * len(head)}"]
        lines += [f"| {' | '.join(row)} |" for row in self.rows()]
        return "\n".join([*lines, "", f"Benchmark {self.benchmark}, {self.cases} cases; intervals at 95 %.", ""])

    def remarks(self) -> list[str]:
        """Lists what is missing in the answers."""
        lines = []
        for tool in self.tools:
            if tool.missing:
                listed = ", ".join(tool.missing[:5]) + (", ..." if len(tool.missing) > 5 else "")
                lines.append(f"{tool.tool}: {len(tool.missing)} cases are missing and count as wrong: {listed}")
            if tool.unpredicted > len(tool.missing):
                lines.append(f"{tool.tool}: {tool.unpredicted} cases have no predicted torque")
        return lines


def score_benchmark(
    folder: str | PathLike[str],
    answers: Sequence[str | PathLike[str]],
    *,
    sealed: str | PathLike[str] | None = None,
) -> Scores:
    """Scores answers against the sealed truth.

    Args:
        folder: the benchmark.
        answers: files of answers, or their folders, of one or more tools.
        sealed: the file of sealed answers; by default the folder's name with ``.answers``.

    Returns:
        A score for each tool.

    Raises:
        InputError: a folder that is no benchmark; sealed answers that are missing, were changed or belong to another
            benchmark; answers that are wrong in form, or answer another benchmark.
    """
    if not answers:
        raise InputError("no answers to score", remedy="name one or more files of answers")
    benchmark = read_benchmark(folder)
    truths = unseal(Path(sealed) if sealed is not None else default_sealed(Path(folder)), benchmark)
    scores: list[ToolScore] = []
    for given in (read_answers(path, benchmark) for path in answers):
        judged = [Judgement(name=name, truth=truths[name], answer=given.cases.get(name)) for name in benchmark.cases]
        scores.append(_scored(given, judged, [score.tool for score in scores]))
    return Scores(benchmark=benchmark.identity, cases=len(benchmark.cases), tools=tuple(scores))


def _scored(given: Answers, judged: Sequence[Judgement], taken: Sequence[str]) -> ToolScore:
    same = sum(name == given.tool or name.startswith(f"{given.tool} (") for name in taken)
    return ToolScore(
        tool=given.tool if not same else f"{given.tool} ({same + 1})",
        figures=figures(judged),
        missing=tuple(case.name for case in judged if case.answer is None),
        unpredicted=sum(case.answer is None or case.answer.torque is None for case in judged),
    )


def figures(judged: Sequence[Judgement]) -> Figures:
    """Computes rates and medians by their titles; each title is defined in ``docs/benchmark.md``.

    Args:
        judged: cases of one tool.
    """
    nothing, one, two, outside = (
        [case for case in judged if case.truth.stratum == stratum] for stratum in ("nothing", "one", "two", "outside")
    )
    hiding = [*one, *two, *outside]
    errors = [error for case in judged if (error := case.error()) is not None]
    squares = [(confidence - right) ** 2 for case in judged for confidence, right in case.confidences()]
    found: dict[str, Rate | Median | Mean] = {
        "false alarm": rate(case.false_alarm for case in nothing),
        "detected": rate(case.detected for case in hiding),
        "one effect: detected": rate(case.detected for case in one),
        "one effect: joint": rate(case.first_has("joint") for case in one),
        "one effect: class and joint": rate(case.first_has("class") for case in one),
        "one effect: name and joint": rate(case.first_has("name") for case in one),
        "two effects: one of them": rate(case.any_found("class") for case in two),
        "two effects: both, by class": rate(case.all_found("class") for case in two),
        "two effects: both, by name": rate(case.all_found("name") for case in two),
        "one or two: a spurious effect": rate(case.spurious for case in [*one, *two]),
        "outside: unexplained": rate(case.unexplained for case in outside),
        "outside: wrongly named": rate(case.spurious for case in outside),
        "intervals with the true value": rate(inside for case in judged for inside in case.intervals()),
        "prediction error over noise": median(errors),
    }
    if squares:
        found["Brier score of confidences"] = Mean(values=tuple(squares))
    return found
