"""Options that may be given again take several values, as shells expand them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import pytest
import typer

from oed.cli.command import Command


def _parsed(words: list[str], argument: bool = False) -> list[Any]:
    """What a command with a list, a value and a flag, and possibly an argument, makes of its words."""
    app = typer.Typer()

    def plain(
        log: Annotated[list[Path] | None, typer.Option("--log", "-l")] = None,
        out: Annotated[Path, typer.Option("--out")] = Path("x"),
        flag: Annotated[bool, typer.Option("--flag")] = False,
    ) -> None: ...

    def named(
        where: Annotated[Path, typer.Argument()], log: Annotated[list[Path] | None, typer.Option()] = None
    ) -> None: ...

    app.command("do", cls=Command)(named if argument else plain)
    params = typer.main.get_command(app).make_context("do", words).params
    return [params[name] for name in (("where", "log") if argument else ("log", "out", "flag"))]


@pytest.mark.parametrize(
    "words",
    [
        ["--log", "a", "b", "c", "--flag", "--out", "o"],
        ["--out", "o", "--log", "a", "--flag", "--log", "b", "c"],
        ["--flag", "--log=a", "b", "c", "--out=o"],
        ["-l", "a", "b", "-l", "c", "--out", "o", "--flag"],
    ],
)
def test_several_values_are_the_option_given_again(words: list[str]) -> None:
    """Whatever stands between, and in which way an option is written."""
    assert _parsed(words) == [[Path("a"), Path("b"), Path("c")], Path("o"), True]


def test_values_of_other_options_stay_single() -> None:
    """A word too many after an option of one value, or after a flag, is reported."""
    for words in (["--out", "o", "p"], ["--log", "a", "--flag", "b"], ["b", "--log", "a"]):
        with pytest.raises(Exception, match="unexpected extra argument"):
            _parsed(words)


def test_a_command_with_an_argument_reads_its_words_as_ever() -> None:
    """There a word after an option's value is the argument."""
    assert _parsed(["--log", "a", "b"], argument=True) == [Path("b"), [Path("a")]]


def test_a_missing_log_among_several_is_named(run: Callable[..., Any], robot: Path, tmp_path: Path) -> None:
    """All files of a glob are read: the second is missed, not taken for a word too many."""
    first = tmp_path / "a.csv"
    first.write_text("t,q1,q2,tau1,tau2\n" + "\n".join(f"{0.004 * k},0,0,0,0" for k in range(2000)))
    done = run("identify", "--robot", robot, "--log", first, tmp_path / "b.csv", "--out", tmp_path / "out")
    assert done.code == 2
    assert "b.csv: no such file" in done.err
