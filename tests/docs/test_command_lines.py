"""The command lines that README and documentation print can be typed as they are."""

from __future__ import annotations

import re
import shlex
from functools import cache
from typing import Any

import pytest
import typer

from benchmarks.sentence_lengths import pages
from oed.cli.app import app


def command_lines() -> list[str]:
    """Every call of `oed` in the shell blocks of README and documentation, once each."""
    found = []
    for path in pages():
        blocks = re.findall(r"```(?:sh|console)\n(.*?)```", path.read_text(encoding="utf-8"), flags=re.DOTALL)
        lines = (line for block in blocks for line in re.split(r"\n|&&", block))
        found += [match[1] for line in lines if (match := re.match(r"\s*(?:\$ )?(?:\.venv/bin/)?(oed .*)", line))]
    return sorted(set(found))


@cache
def commands() -> dict[str, Any]:
    """The program's commands by name."""
    return dict(typer.main.get_command(app).commands)


@pytest.mark.slow
@pytest.mark.parametrize("line", command_lines())
def test_options_exist(line):
    """A printed call names a command of the program, options that it has, and all that it requires."""
    _, name, *words = shlex.split(line, comments=True)
    parameters = commands()[name].params
    known = {spelling for p in parameters for spelling in (*p.opts, *p.secondary_opts)}
    used = {word.split("=")[0] for word in words if re.match(r"--?[a-z]", word)}
    assert used <= known
    required = [p for p in parameters if p.required and p.param_type_name == "option"]
    assert all(used.intersection(p.opts) for p in required)


def test_there_are_command_lines():
    """The quick start and the tour are among the lines that are checked."""
    assert len(command_lines()) > 20
