"""The page on commands has a section for each command, with the table of options that its class declares."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from oed.cli.app import VERBS
from oed.cli.declarations.declared import declared_options
from oed.cli.declarations.reference import COMMON, option_table, with_option_tables

PAGE = (Path(__file__).parents[2] / "docs" / "commands.md").read_text(encoding="utf-8")
SECTIONS = dict(re.findall(r"^## `oed (\w+)`\n(.*?)(?=^## |\Z)", PAGE, flags=re.MULTILINE | re.DOTALL))


def test_every_command_has_its_section():
    """The page has a section for every command, and none for anything else."""
    assert set(SECTIONS) == set(VERBS)


@pytest.mark.parametrize("name", sorted(VERBS))
def test_sections_have_their_table(name):
    """A section has the table of its command, with a row for each option that not all commands have, and no other."""
    rows = [option for field, option in declared_options(VERBS[name]).items() if field not in COMMON]
    assert SECTIONS[name].count("<!-- options:") == SECTIONS[name].count(f"<!-- options: {name} -->") == bool(rows)
    table = with_option_tables(SECTIONS[name], VERBS)
    assert len(re.findall(r"^\| `[^`]+` \|", table, flags=re.MULTILINE)) == len(rows)
    assert all(option.help in table for option in rows)


@pytest.mark.parametrize("name", sorted(VERBS))
def test_section_has_an_example(name):
    """Every section shows the command at work."""
    assert re.search(rf"oed {name}\b", SECTIONS[name])


@pytest.mark.parametrize("name", sorted(VERBS))
def test_every_option_is_described(name):
    """No option is without words, or without an end to them."""
    for option in declared_options(VERBS[name]).values():
        assert re.fullmatch(r".{10,}\.", option.help), f"--{option.name}"


def test_defaults_stand_in_the_table():
    """As they are typed: numbers, texts, flags in words, lists with commas; required options come first."""
    table = option_table(VERBS["design"])
    assert "| `--criterion` | - |" in table
    assert "| `--torque / --no-torque` | `--torque` |" in table
    assert "| `--kinds` | `joint_zero,link_placement` |" in table
    assert table.splitlines()[2].startswith("| `--robot` | required |")


def test_common_options_are_described():
    """The options that all commands share are described at the top, and all commands have them."""
    head = PAGE.split("## `oed")[0]
    assert all(f"`--{name}`" in head for name in (*COMMON, "config", "help"))
    for verb in VERBS.values():
        options = declared_options(verb)
        # A command that writes no file has nothing to overwrite.
        assert {"json", "quiet", *(("force",) if "out" in options else ())} <= set(options)
