"""The page on commands is in step with the command line."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import typer

from oed.cli.app import app

PAGE = (Path(__file__).parents[2] / "docs" / "commands.md").read_text(encoding="utf-8")
SECTIONS = dict(re.findall(r"^## `oed (\w+)`\n(.*?)(?=^## |\Z)", PAGE, flags=re.MULTILINE | re.DOTALL))
# What every command has is described once, at the top of the page.
COMMON = {"--force", "--json", "--quiet", "--config", "--help"}


@cache
def commands() -> dict[str, Any]:
    """Every command of the program."""
    return dict(typer.main.get_command(app).commands)


def offered(command: Any) -> dict[str, str]:
    """Each option as it is typed, or each argument's name, with its default as documented: - where there is none."""
    rows = {}
    for parameter in command.params:
        if parameter.param_type_name == "argument":
            rows[parameter.name.upper()] = "required" if parameter.required else "-"
            continue
        spelling = " / ".join((*parameter.opts, *parameter.secondary_opts))
        default = parameter.default
        if isinstance(default, bool):
            default = parameter.opts[0] if default else (parameter.secondary_opts or ["-"])[0]
        rows[spelling] = "required" if parameter.required else "-" if default in (None, ()) else str(default)
    return {name: default for name, default in rows.items() if name not in COMMON}


def documented(section: str) -> dict[str, str]:
    """The option and default columns of a section's table."""
    rows = re.findall(r"^\| `([^`]+)` \| (.*?) \|", section, flags=re.MULTILINE)
    return {name: default.strip("`") for name, default in rows}


def test_every_command_has_its_section():
    """The page has a section for every command, and none for anything else."""
    assert set(SECTIONS) == set(commands())


@pytest.mark.parametrize("name", sorted(commands()))
def test_options_are_those_of_the_command(name):
    """A section's table lists the command's arguments and options with their defaults, no more and no fewer."""
    assert documented(SECTIONS[name]) == offered(commands()[name])


@pytest.mark.parametrize("name", sorted(commands()))
def test_section_has_an_example(name):
    """Every section shows the command at work."""
    assert re.search(rf"oed {name}\b", SECTIONS[name])


def test_common_options_are_described():
    """The options that all commands share are described at the top, and all commands have them."""
    head = PAGE.split("## `oed")[0]
    assert all(f"`{option}`" in head for option in COMMON)
    for command in commands().values():
        options = {name for parameter in command.params for name in parameter.opts}
        # A command that writes no file has nothing to overwrite.
        assert COMMON - {"--help"} - (set() if "--out" in options else {"--force"}) <= options
