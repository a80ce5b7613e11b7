"""Makes blind cases with hidden effects, answers them by a method, or scores any tool's answers.

The answers are sealed in a file beside the folder, whose hash the folder states.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar

from oed.benchmarks.making.options import MakeOptions
from oed.cli.declarations.declared import declared_options
from oed.cli.options.results import Overwriting
from oed.cli.verbs import Printed, Verb
from robots.common.errors import InputError
from robots.common.options import Option
from robots.common.progress import Progress

OfMake, OfAnswer = Option(only=("make",)), Option(only=("answer",))


@dataclass(frozen=True, kw_only=True)
class Benchmark(Verb):
    """``oed benchmark``.

    Attributes:
        action: what to do: make, answer or score.
        folder: folder of the benchmark.
        files: files of answers, or their folders.
        seed: seed of the random numbers. Default: a secret one. Who knows the seed knows the answers.
        by: the method: oed, residual-fit or threshold.
        answers: the file of sealed answers. Default: FOLDER.answers.
        out: folder for the answers. Default: FOLDER.BY.
        markdown: also write the table as Markdown to this file.
        workers: number of parallel processes. Default: one per core.
    """

    function = "oed.benchmarks.make_benchmark"
    examples = (
        "oed benchmark make blind --cases 24",
        "oed benchmark answer blind --by residual-fit",
        "oed benchmark score blind blind.residual-fit others/answers.json --markdown table.md",
    )

    uses: ClassVar = {"make": "of make", "answer": "of answer", "score": "of score"}

    action: Annotated[str, Option(argument=True)]
    folder: Annotated[Path, Option(argument=True)]
    files: Annotated[tuple[Path, ...], Option(argument=True, only=("score",))] = ()
    made: Annotated[MakeOptions, OfMake] = MakeOptions()
    seed: Annotated[int | None, Option(least=0, only=("make",))] = None
    by: Annotated[str | None, OfAnswer] = None
    answers: Annotated[Path | None, Option(only=("make", "score"))] = None
    out: Annotated[Path | None, Option(section="Output", only=("answer",))] = None
    markdown: Annotated[Path | None, Option(section="Output", only=("score",))] = None
    workers: Annotated[int | None, Option(least=1, only=("make", "answer"))] = None
    overwriting: Overwriting = Overwriting()

    @property
    def use(self) -> str:
        """What to do."""
        return self.action

    def unused(self) -> Collection[str]:
        """Nothing is foreign to an action that there is not: `run` names those that there are."""
        return super().unused() if self.action in ("make", "answer", "score") else ()

    def refusal(self, names: Collection[str]) -> InputError:
        """Names the action to which the option belongs."""
        first = next(iter(names))
        option = next(option for option in declared_options(type(self)).values() if f"--{option.name}" == first)
        if option.how.argument:
            return InputError(
                f"{self.files[0]} beside `oed benchmark {self.action}`", remedy="files of answers belong to score"
            )
        owners = " and ".join(option.how.only)
        return InputError(f"{first} beside `oed benchmark {self.action}`", remedy=f"it belongs to {owners}")

    def kept(self) -> str:
        """Says that answers are kept."""
        return "the same command continues where it was" if self.action == "answer" else "nothing was written"

    def run(self, progress: Progress) -> Printed:
        """Makes, answers or scores."""
        try:
            from oed.benchmarks.making import make_benchmark
            from oed.benchmarks.scores import score_benchmark
            from oed.benchmarks.solving import METHODS, answer_benchmark
        except ModuleNotFoundError as error:
            raise InputError(
                f"the benchmark needs the package {error.name}, which is not installed",
                remedy="pip install pin (Linux and macOS)",
            ) from error
        from robots.common.files import write_atomic

        how: dict[str, Any] = {"force": self.overwriting.force, "workers": self.workers, "progress": progress}
        if self.action == "make":
            made = make_benchmark(self.folder, options=self.made, seed=self.seed, sealed=self.answers, **how)
            return Printed(f"{made.summary()}\nwritten to {self.folder.resolve()}", made.to_dict())
        if self.action == "answer":
            if self.by is None:
                raise InputError("no method", allowed=", ".join(METHODS), remedy="name it with --by")
            place = self.folder.absolute()
            target = self.out or place.with_name(f"{place.name}.{self.by}")
            answered = answer_benchmark(self.folder, by=self.by, out=target, **how)
            return Printed(f"{answered.summary()}\nwritten to {target.resolve()}", answered.to_dict())
        if self.action != "score":
            raise InputError(f"oed benchmark {self.action}", allowed="make, answer or score")
        scores = score_benchmark(self.folder, self.files, sealed=self.answers)
        summary = scores.summary()
        if self.markdown is not None:
            write_atomic(self.markdown, scores.markdown(), force=self.overwriting.force)
            summary += f"\nwritten to {self.markdown.resolve()}"
        return Printed(summary, scores.to_dict())
