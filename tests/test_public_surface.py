"""The public surface: at most thirty names a package, and a function of it behind each command."""

from __future__ import annotations

import importlib
import inspect

import pytest

from oed.cli.app import VERBS
from oed.cli.declarations.reference import function_table

MOST = 30
FUNCTIONS = {name: verb.function for name, verb in VERBS.items() if verb.function}


@pytest.mark.parametrize("name", ["oed", "estimation", "robots"])
def test_packages_show_few_names(name: str) -> None:
    """A package has at most thirty public names."""
    assert 0 < len(importlib.import_module(name).__all__) <= MOST


def test_every_command_that_works_has_a_function() -> None:
    """Only commands that list or print have none."""
    assert set(VERBS) - set(FUNCTIONS) == {"example", "robots", "effects", "explain", "doctor", "schema"}
    assert all(f"| `oed {name}` | `{path}` |" in function_table(VERBS) for name, path in FUNCTIONS.items())


@pytest.mark.parametrize("command", FUNCTIONS)
def test_functions_of_commands_are_public(command: str) -> None:
    """The function is a public name of a package; what it works on comes first, and choices are named.

    A long one is given an object that hears of its progress, as the last argument.
    """
    package, _, name = FUNCTIONS[command].rpartition(".")
    module = importlib.import_module(package)
    assert name in module.__all__
    if inspect.isclass(getattr(module, name)):
        return
    parameters = list(inspect.signature(getattr(module, name)).parameters.values())
    kinds = [parameter.kind for parameter in parameters]
    assert kinds == sorted(kinds)
    names = [parameter.name for parameter in parameters]
    if "progress" in names:
        assert names[-1] == "progress"
        assert parameters[-1].kind is inspect.Parameter.KEYWORD_ONLY
