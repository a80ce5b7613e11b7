"""Help by purpose: every command and option has its place, every example can be typed."""

from __future__ import annotations

import shlex

import pytest
import typer

from oed.cli.app import COMMANDS, VERBS, app
from oed.cli.declarations.declared import INPUT, declared_options

PROGRAM = typer.main.get_command(app)
NAMES = list(PROGRAM.commands)


@pytest.mark.parametrize("name", NAMES)
def test_examples_can_be_typed(name: str) -> None:
    """Each command has examples, which its parser accepts."""
    for line in VERBS[name].examples:
        words = shlex.split(line)
        assert words[:2] == ["oed", name]
        PROGRAM.commands[name].make_context(name, words[2:])


@pytest.mark.parametrize("flag", ["-h", "--help"])
def test_help_of_the_program(run, flag: str) -> None:
    """All commands are there with what they do, under the titles of the groups, in both spellings."""
    done = run(flag)
    assert done.code == 0
    text = " ".join(done.out.split())
    for name in NAMES:
        summary = VERBS.summary(name)
        assert summary.endswith(".")
        assert f" {name} {summary}" in text
    assert all(f"\n{title}:\n" in done.out for title in COMMANDS)


@pytest.mark.parametrize("name", NAMES)
def test_help_of_a_command(run, name: str) -> None:
    """Every option is listed once, under its purpose, and examples stand at the end."""
    text = run(name, "-h").out
    sections = {field: option.section for field, option in declared_options(VERBS[name]).items()} | {"config": INPUT}
    assert text == run(name, "--help").out
    for parameter in PROGRAM.commands[name].params:
        if parameter.param_type_name == "option":
            section = text.split(f"\n{sections[parameter.name]}:\n")[1].split("\n\n")[0]
            assert f"  {parameter.opts[0]} " in section or f"  {parameter.opts[0]}\n" in section
    assert text.rstrip().endswith(VERBS[name].examples[-1])


@pytest.mark.parametrize(
    ("words", "expected"),
    [("oed iden", "identify"), ("oed identify --ro", "--robot\n--rotor"), ("oed design --tor", "--torque-margin")],
)
def test_completion_knows_commands_and_options(monkeypatch, capsys, words: str, expected: str) -> None:
    """The shell's question is answered without running a command."""
    monkeypatch.setenv("_OED_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", words)
    monkeypatch.setenv("COMP_CWORD", str(words.count(" ")))
    with pytest.raises(SystemExit) as stop:
        app(prog_name="oed", standalone_mode=False)
    assert stop.value.code == 0
    assert expected in capsys.readouterr().out


def test_parsers_are_made_when_they_are_asked_for() -> None:
    """The help of the program makes none of the commands' parsers."""
    fresh = typer.main.get_command(app)
    assert set(fresh.commands) == set(NAMES)
    assert fresh.commands._made == {}
    assert fresh.commands["design"] is fresh.commands["design"]
    assert list(fresh.commands._made) == ["design"]


def test_help_lists_the_estimators(run) -> None:
    """The choices of --method are those of the registry."""
    from estimation.estimators import ESTIMATORS

    text = " ".join(run("identify", "-h").out.split())
    listed = text.split("Estimator: ")[1].split(";")[0].replace(" or ", ", ").split(", ")
    assert sorted(listed) == sorted(ESTIMATORS)
