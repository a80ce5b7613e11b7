"""``oed benchmark``: blind cases, answers to them, and their scores."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from oed.cli.console import Console
from oed.cli.links import is_given
from oed.cli.options import ForceOption, JsonOption, QuietOption, WorkersOption

BELONGS = {
    "cases": "make",
    "robots": "make",
    "size": "make",
    "noise": "make",
    "duration": "make",
    "unseen": "make",
    "seed": "make",
    "by": "answer",
    "out": "answer",
    "markdown": "score",
}
"""The action to which an option belongs; those of two are not listed."""


def benchmark(
    context: typer.Context,
    action: Annotated[str, typer.Argument(help="What to do: make, answer or score.", show_default=False)],
    folder: Annotated[Path, typer.Argument(help="Folder of the benchmark.", show_default=False)],
    files: Annotated[
        list[Path] | None,
        typer.Argument(help="Of score: files of answers, or their folders.", show_default=False),
    ] = None,
    cases: Annotated[int, typer.Option(help="Of make: number of cases.")] = 24,
    robots: Annotated[
        str, typer.Option(help="Of make: kinds of robots, comma-separated: ur10, panda, heavy (200 kg class), er3a.")
    ] = "ur10,panda,heavy,er3a",
    size: Annotated[
        float,
        typer.Option(
            help=(
                "Of make: visible size of a single effect, the RMS that the base model cannot fit over the joint's "
                "torque RMS. Each of two effects has three times the size."
            )
        ),
    ] = 0.01,
    noise: Annotated[float, typer.Option(help="Of make: RMS of the torque noise over the torque RMS.")] = 0.025,
    duration: Annotated[float, typer.Option(help="Of make: duration of each log [s].")] = 60.0,
    unseen: Annotated[float, typer.Option(help="Of make: duration of each unseen motion [s].")] = 30.0,
    seed: Annotated[
        int | None,
        typer.Option(
            min=0,
            help="Of make: seed of the random numbers. Default: a secret one. Who knows the seed knows the answers.",
            show_default=False,
        ),
    ] = None,
    by: Annotated[
        str | None,
        typer.Option(help="Of answer: the method: oed, residual-fit or threshold.", show_default=False),
    ] = None,
    answers: Annotated[
        Path | None,
        typer.Option(
            help="Of make and score: the file of sealed answers. Default: FOLDER.answers.", show_default=False
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Of answer: folder for the answers. Default: FOLDER.BY.", show_default=False)
    ] = None,
    markdown: Annotated[
        Path | None, typer.Option(help="Of score: also write the table as Markdown to this file.", show_default=False)
    ] = None,
    workers: WorkersOption = None,
    force: ForceOption = False,
    json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Makes blind cases with hidden effects, answers them by a method, or scores any tool's answers.

    The answers are sealed in a file beside the folder, whose hash the folder states.
    """
    console = Console(json=json, quiet=quiet)
    with console.working() as progress:
        from robots.common.errors import InputError
        from robots.common.files import write_atomic

        try:
            from oed.benchmarks.making import MakeOptions, make_benchmark
            from oed.benchmarks.scores import score_benchmark
            from oed.benchmarks.solving import METHODS, answer_benchmark
        except ModuleNotFoundError as error:
            raise InputError(
                f"the benchmark needs the package {error.name}, which is not installed",
                remedy="pip install pin (Linux and macOS)",
            ) from error

        if action not in ("make", "answer", "score"):
            raise InputError(f"oed benchmark {action}", allowed="make, answer or score")
        for name, owner in BELONGS.items():
            if owner != action and is_given(context, name):
                raise InputError(f"--{name} beside `oed benchmark {action}`", remedy=f"it belongs to {owner}")
        if action == "score" and workers is not None:
            raise InputError("--workers beside `oed benchmark score`", remedy="it belongs to make and answer")
        if files and action != "score":
            raise InputError(f"{files[0]} beside `oed benchmark {action}`", remedy="files of answers belong to score")
        if action == "answer" and answers is not None:
            raise InputError("--answers beside `oed benchmark answer`", remedy="blind cases are answered without them")
        if action == "make":
            options = MakeOptions(
                cases=cases,
                robots=tuple(name.strip() for name in robots.split(",")),
                size=size,
                noise=noise,
                duration=duration,
                unseen=unseen,
            )
            made = make_benchmark(
                folder, options=options, seed=seed, sealed=answers, force=force, workers=workers, progress=progress
            )
            summary, data = f"{made.summary()}\nwritten to {folder.resolve()}", made.to_dict()
        elif action == "answer":
            if by is None:
                raise InputError("no method", allowed=", ".join(METHODS), remedy="name it with --by")
            target = out if out is not None else folder.absolute().with_name(f"{folder.absolute().name}.{by}")
            try:
                answered = answer_benchmark(folder, by=by, out=target, force=force, workers=workers, progress=progress)
            except KeyboardInterrupt:
                print("oed: interrupted; the same command continues where it was", file=sys.stderr)
                raise typer.Exit(130) from None
            summary, data = f"{answered.summary()}\nwritten to {target.resolve()}", answered.to_dict()
        else:
            scores = score_benchmark(folder, files or (), sealed=answers)
            summary, data = scores.summary(), scores.to_dict()
            if markdown is not None:
                write_atomic(markdown, scores.markdown(), force=force)
                summary += f"\nwritten to {markdown.resolve()}"
    console.result(summary, data)
