"""Defaults from ``oed.toml``: where it is found, what wins, and how a wrong file is answered."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable
from html import unescape
from pathlib import Path
from typing import Any

import pytest
import typer

from oed.cli.app import VERBS, app
from oed.cli.configuration.file import named_options
from oed.cli.declarations.chosen import chosen
from oed.cli.declarations.declared import declared_options

PROGRAM = typer.main.get_command(app)


@pytest.fixture
def cell(tmp_path: Path, robot: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working directory without a file, with a robot and a log in a folder of their own."""
    folder = tmp_path / "cell"
    folder.mkdir()
    (folder / "two.yaml").write_text(robot.read_text())
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("OED_CONFIG", raising=False)
    return folder


def _context(command: str, *words: str) -> Any:
    """A command's words, parsed."""
    root = PROGRAM.make_context("oed", [command, *words])
    with root:
        return PROGRAM.commands[command].make_context(command, list(words), parent=root)


def _values(command: str, *words: str) -> dict[str, Any]:
    """What was typed of each option, or is in the file."""
    return dict(_context(command, *words).params)


def test_top_table_and_command_line(cell: Path) -> None:
    """The command line wins over the command's table, and that over the top."""
    Path("oed.toml").write_text('robot = "er3a"\nseed = 1\n[identify]\nseed = 2\n[design]\nseed = 3\nstrokes = false\n')
    assert _values("identify", "--log", "a")["seed"] == 2
    assert _values("identify", "--log", "a", "--seed", "7")["seed"] == 7
    assert _values("thermal", "--log", "a")["seed"] == 1
    design = _values("design", "--robot", "panda")
    assert (design["robot"], design["seed"], design["strokes"]) == ("panda", 3, False)
    assert _values("design", "--strokes")["strokes"] is True


def test_which_file_is_read(cell: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`--config`, before or behind the command, then OED_CONFIG, then the working directory; none reads no file."""
    for name, seed in (("oed.toml", 1), ("variable.toml", 2), ("option.toml", 3)):
        Path(name).write_text(f'robot = "er3a"\nseed = {seed}\n')
    assert _values("design")["seed"] == 1
    monkeypatch.setenv("OED_CONFIG", "variable.toml")
    assert _values("design")["seed"] == 2
    assert _values("design", "--config", "option.toml")["seed"] == 3
    root = PROGRAM.make_context("oed", ["--config", "option.toml", "design"])
    assert PROGRAM.commands["design"].make_context("design", [], parent=root).params["seed"] == 3
    assert _values("design", "--config", "none", "--robot", "panda")["seed"] == 0
    monkeypatch.setenv("OED_CONFIG", "none")
    assert _values("design", "--robot", "panda")["seed"] == 0


def test_values_of_each_kind(cell: Path) -> None:
    """Paths start at the file's folder, in texts too; arrays of numbers are comma-separated texts."""
    (cell / "lab.toml").write_text(
        'robot = "two.yaml"\nmapping = "columns.yaml"\ngravity = [0, -2.5, 9]\n'
        'payload = ["1=tool.json", "2=5,0,0,0.1"]\n'
        "[design]\nhome = [0, 0.5]\npayload = '/abs/tool.json'\ntime-limit = 3\n[identify]\nlog = ['a.csv', 'b.csv']\n"
        "position = false\n"
    )
    found = _values("identify", "--config", "cell/lab.toml")
    assert found["robot"] == "cell/two.yaml"
    assert found["mapping"] == Path("cell/columns.yaml")
    assert found["gravity"] == ["0,-2.5,9"]
    assert found["payload"] == ["1=cell/tool.json", "2=5,0,0,0.1"]
    assert found["log"] == [Path("cell/a.csv"), Path("cell/b.csv")]
    assert found["position"] is False
    design = _values("design", "--config", "cell/lab.toml")
    assert (design["home"], design["payload"], design["time_limit"]) == ("0,0.5", "/abs/tool.json", 3.0)


def test_a_command_and_an_option_of_one_name(cell: Path) -> None:
    """The option is a value; the command's table then stands in [command]."""
    Path("oed.toml").write_text('payload = "t.json"\n[command.payload]\nseed = 5\n')
    found = _values("payload", "--log", "a")
    assert (found["seed"], found["payload"]) == (5, ["t.json"])


@pytest.mark.parametrize(
    ("text", "words", "parts"),
    [
        ('robto = "er3a"', "", ["key robto: no command has this option", "did you mean robot?"]),
        ('torque_is = "motor"', "", ["key torque_is", "did you mean torque-is?"]),
        ("[identify]\nsed = 3", "", ["key identify.sed", "did you mean seed?"]),
        ("[identfy]\nseed = 3", "", ["key identfy: there is no such command", "did you mean identify?"]),
        ("[command.identfy]\nseed = 3", "", ["key command.identfy", "did you mean identify?"]),
        ("[identify]\nseed = 'a'", "", ["key identify.seed: found 'a'", "a whole number"]),
        ("[identify]\nseed = true", "", ["key identify.seed: found True", "a whole number"]),
        ("seed = -1", "", ["key seed: found -1", "0 or more"]),
        ("robot = 3", "", ["key robot: found 3", "a text"]),
        ("robot = ['a', 'b']", "", ["key robot", "a text"]),
        ("[mapping]\nq = 1", "", ["key mapping: found a table", "a path"]),
        ("command = 3", "", ["key command", "[command.identify]"]),
        ("log = ['a', 'b']", "predict", ["key log", "a path", "not of oed predict"]),
        ("seed = \n", "", ["not valid TOML", "line 1"]),
        ("payload = 't'\n[payload]\nseed = 1", "", ["not valid TOML", "[command.NAME]"]),
    ],
)
def test_a_wrong_file_is_one_message(
    run: Callable[..., Any], cell: Path, text: str, words: str, parts: list[str]
) -> None:
    """File, key, what would be right; exit code 2, whichever command runs."""
    Path("oed.toml").write_text(text)
    done = run(*(words.split() or ["effects"]))
    assert done.code == 2
    assert done.out == ""
    assert done.err.startswith("oed: oed.toml: ")
    assert done.err.count("\n") == 1
    assert all(part in done.err for part in parts), done.err


def test_a_missing_or_binary_file(run: Callable[..., Any], cell: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file that was named must be there and be text."""
    Path("binary.toml").write_bytes(b"\xff\xfe\x00")
    assert "no such file" in run("effects", "--config", "none.toml").err
    assert "UTF-8" in run("effects", "--config", "binary.toml").err
    monkeypatch.setenv("OED_CONFIG", "gone.toml")
    done = run("effects")
    assert done.code == 2
    assert "gone.toml: no such file; the variable OED_CONFIG names this file" in done.err
    assert run("identify", "--help").code == 0


def test_what_came_from_the_file_is_said_once(run: Callable[..., Any], cell: Path) -> None:
    """One note on the standard error; none with --quiet, none in the JSON, none for what was typed."""
    Path("oed.toml").write_text('robot = "cell/two.yaml"\ntorque-is = "motor"\nperiod = 0.01\n')
    err = run("export", "x.csv").err
    assert err.startswith("note: from oed.toml: --robot cell/two.yaml --period 0.01\n")
    assert err.count("oed.toml") == 1
    assert "from oed.toml: --period 0.01\n" in run("export", "x.csv", "--robot", "er3a").err
    assert "oed.toml" not in run("export", "x.csv", "--quiet").err
    assert "oed.toml" not in run("effects").err
    Path("oed.toml").write_text("quiet = true\nseed = 1\n")
    done = run("effects")
    assert (done.code, done.out, done.err) == (0, "", "")


def test_doctor_shows_the_file(run: Callable[..., Any], cell: Path) -> None:
    """Path, origin and keys; of a wrong file the problem, and exit code 1."""
    assert "Configuration file: none" in run("doctor").out
    Path("oed.toml").write_text('robot = "er3a"\n[identify]\nseed = 1\n')
    found = run("doctor", "--json").data["configuration"]
    assert found == {
        "file": str(Path("oed.toml").resolve()),
        "origin": "working directory",
        "keys": ["robot", "identify.seed"],
        "problem": None,
    }
    assert "(working directory): robot, identify.seed" in run("doctor").out
    Path("oed.toml").write_text("robto = 1\n")
    done = run("doctor")
    assert done.code == 1
    assert "oed.toml: key robto" in done.out


@pytest.mark.parametrize(
    ("words", "unused", "used"),
    [
        ("diagnose --log a", {"trajectory", "model"}, {"robot", "mapping"}),
        ("diagnose --limits", {"mapping", "payload", "gravity"}, {"robot", "trajectory", "model"}),
        ("compare a.json b.json", {"robot", "mapping"}, {"seed"}),
        ("compare a.csv b.csv", set(), {"robot", "mapping"}),
        ("payload --log a --without b", {"model", "payload"}, {"robot", "gravity"}),
        ("payload --log a", set(), {"robot", "gravity", "payload", "model"}),
        ("simulate --campaign c", {"trajectory", "model", "payload"}, {"robot"}),
        ("simulate --plant p", {"model"}, {"robot", "trajectory"}),
        ("design --payload-only", {"criterion", "essential"}, {"robot", "payload"}),
        ("design --discriminate a,b", {"criterion", "essential", "payload"}, {"robot", "seed"}),
        ("force --log a --calibration c", {"healthy"}, {"model"}),
    ],
)
def test_defaults_that_do_not_apply_are_left_out(cell: Path, words: str, unused: set[str], used: set[str]) -> None:
    """What was typed decides; a default beside it is no contradiction."""
    Path("oed.toml").write_text(
        'robot = "er3a"\nmapping = "m.yaml"\nmodel = "m.json"\ngravity = "0,0,-9.8"\npayload = "1,0,0,0.1"\nseed = 4\n'
        "trajectory = 't.csv'\nhealthy = 'h.csv'\n[design]\ncriterion = 'a'\nessential = 0.1\n"
    )
    command, *rest = shlex.split(words)
    context = _context(command, *rest)
    verb, filed = chosen(VERBS[command], context)
    assert unused <= set(context.default_map) - filed
    assert used <= filed
    options = declared_options(type(verb))
    own = {name: getattr(verb, name) for name in unused if hasattr(verb, name)}
    assert all(value == options[name].value(options[name].default) for name, value in own.items())


def test_declarations_give_the_options_of_the_parsers() -> None:
    """Each option of each command may stand in the file, under the name that is typed."""
    for name, verb in VERBS.items():
        parsed = {
            (p.opts[0].lstrip("-"), p.name, p.multiple, (p.secondary_opts or [""])[0].lstrip("-"))
            for p in PROGRAM.commands[name].params
            if p.param_type_name == "option" and p.name != "config"
        }
        read = {(o.name, o.field, o.several, o.negative or "") for o in named_options(verb).values()}
        assert read == parsed


@pytest.mark.slow
def test_the_command_in_a_report_repeats_the_result(run: Callable[..., Any], cell: Path, experiment: Path) -> None:
    """It contains the file's options, and gives the same model when the file says something else."""
    (cell / "log.csv").write_bytes((experiment / "log.csv").read_bytes())
    Path("oed.toml").write_text(
        'robot = "cell/two.yaml"\ngravity = [0, 0, -9.7]\n[identify]\nmethod = "ols"\noffset = false\nout = "first"\n'
    )
    done = run("identify", "--log", "cell/log.csv", "--json", "--config", "oed.toml")
    assert done.code == 0, done.err
    page = unescape(Path("first/report.html").read_text())
    line = re.findall(r"oed identify [^<]*--config none", page)[0]
    words = shlex.split(line)[1:]
    assert "oed.toml" not in words
    Path("oed.toml").write_text("gravity = [0, 0, -5.0]\nseed = 3\n")
    again = run(*words, "--out", "second")
    assert again.code == 0, again.err
    assert again.data == done.data
