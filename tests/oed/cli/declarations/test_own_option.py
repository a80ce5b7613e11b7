"""A new option is one field: of a class that no file of the program knows."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import pytest
import typer

from oed.cli.app import VERBS, Oed
from oed.cli.commands.first_steps.effects import Effects
from oed.cli.configuration.schema import configuration_schema
from oed.cli.declarations.reference import option_table
from oed.cli.program import Verbs
from oed.cli.verbs import Printed
from robots.common.options import Option, numbers
from robots.common.progress import Progress


@dataclass(frozen=True, kw_only=True)
class Own(Effects):
    """A command with options of its own.

    Attributes:
        loudness: how loud it is [dB]. ``loud`` is what it is
            not by default.
        place: X,Y,Z [m].
        slow: take your time.
    """

    alternatives = (("slow", "place"),)

    loudness: Annotated[float, Option(least=0.0)] = 3.0
    place: Annotated[tuple[float, ...] | None, Option(reads=numbers, section="Input")] = None
    slow: Annotated[bool, Option(only=("quietly",))] = False

    @property
    def use(self) -> str:
        """Loud or not."""
        return "quietly" if self.loudness < 1.0 else "loudly"

    def run(self, progress: Progress) -> Printed:
        """Shows what it got."""
        return Printed(
            f"{self.loudness} {self.place}", {"loudness": self.loudness, "place": self.place, "slow": self.slow}
        )


@pytest.fixture
def verbs(monkeypatch: pytest.MonkeyPatch) -> Verbs:
    """The commands of the program, and one more."""
    found = Verbs({**VERBS._modules, "own": __name__})
    monkeypatch.setitem(sys.modules, __name__, sys.modules[Own.__module__])
    monkeypatch.setattr(Oed, "verbs", found)
    monkeypatch.setattr("oed.cli.app.VERBS", found)
    return found


@pytest.fixture
def own(run: Callable[..., Any], verbs: Verbs) -> Callable[..., Any]:
    """Runs the command."""
    from oed.cli import app as module

    program = typer.main.get_command(module.app)
    assert "own" in program.commands
    return lambda *words: run("own", *words)


def test_it_is_in_the_help(own: Callable[..., Any]) -> None:
    """With its type, text, range and default, in its section."""
    text = " ".join(own("--help").out.split())
    assert "Settings: --loudness <float range> How loud it is [dB]. loud is what it is not by default." in text
    assert "[default: 3.0; x>=0.0]" in text
    assert "Input: --place <str> X,Y,Z [m]." in text


def test_it_is_in_the_configuration_file(own: Callable[..., Any], tmp_path: Path, monkeypatch) -> None:
    """Under its name, in its range; what is typed goes before, and what does not apply is left out."""
    monkeypatch.chdir(tmp_path)
    Path("oed.toml").write_text("loudness = 7\nplace = [1, 2, 3]\n[own]\nslow = true\n")
    assert own("--json", "--slow", "--loudness", "0.5").data == {"loudness": 0.5, "place": None, "slow": True}
    assert own("--json", "--place", "0,0,1").data == {"loudness": 7.0, "place": [0.0, 0.0, 1.0], "slow": False}
    Path("oed.toml").write_text("loudness = -1\n")
    done = own()
    assert done.code == 2
    assert "key loudness: found -1; allowed: 0 or more" in done.err


def test_what_excludes_what_is_said_once(own: Callable[..., Any]) -> None:
    """An option of another use, and one of two alternatives, are refused."""
    assert own("--slow").err == "oed: --slow does not apply with `loudly`; remove them (OED-O002)\n"
    assert "--slow and --place together" in own("--slow", "--place", "1,2,3", "--loudness", "0").err
    assert "--place 1,x; allowed: numbers" in own("--place", "1,x").err


def test_it_is_in_the_schema(verbs: Verbs) -> None:
    """With its text, type, range and default, at the top and in the command's table."""
    whole = configuration_schema(verbs)
    schema = whole["properties"]
    stated = {"description": "How loud it is [dB]. loud is what it is not by default.", "type": "number"}
    assert schema["loudness"] == {**stated, "minimum": 0.0, "default": 3.0}
    assert schema["own"] == schema["command"]["properties"]["own"] == {"$ref": "#/definitions/own"}
    assert whole["definitions"]["own"]["properties"]["loudness"] == schema["loudness"]
    assert {"type": "array", "items": {"type": "number"}} in schema["place"]["anyOf"]


def test_it_is_in_the_reference() -> None:
    """With its default and its text."""
    assert "| `--loudness` | `3.0` | How loud it is [dB]. loud is what it is not by default. |" in option_table(Own)
