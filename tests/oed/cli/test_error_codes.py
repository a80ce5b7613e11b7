"""Codes of frequent errors: what the table calls an example ends with the code, and `oed explain` explains it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimation import write_log
from robots.common.errors import ERROR_CODES, ERRORS
from robots.signals import Log
from tests.oed.reports.pages.test_pages_in_browser import payload

BRANCHES = """<robot name="two"><link name="base"/><link name="a"/><link name="b"/>
<joint name="ja" type="revolute"><parent link="base"/><child link="a"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="jb" type="revolute"><parent link="base"/><child link="b"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""
XACRO = '<robot name="x" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="$(arg side)"/></robot>'
MAPPING = "time: {column: Zeit}\n"

SHOW, CHECK = ("robot", "show"), ("check", "--robot", "er3a")

COMMANDS: dict[str, tuple[str, ...]] = {
    "missing_column": (*CHECK, "unnamed.csv"),
    "unknown_file_type": (*CHECK, "run.xyz"),
    "empty_file": (*CHECK, "empty.csv"),
    "other_joints": (*CHECK, "two.csv"),
    "no_numbers": (*CHECK, "blank.csv"),
    "unknown_unit": (*CHECK, "unit.csv"),
    "given_twice": ("check", "--robot", "two.urdf", "two.csv", "two.csv"),
    "mapping_without_column": (*CHECK, "two.csv", "--mapping", "mapping.yaml"),
    "no_logs": (*CHECK, "nothing"),
    "unknown_robot": (*SHOW, "ur99"),
    "branches": (*SHOW, "branches.urdf"),
    "unknown_link": (*SHOW, "branches.urdf", "--tip", "c"),
    "unknown_joint": (*SHOW, "branches.urdf", "--joints", "jc"),
    "broken_xml": (*SHOW, "broken.urdf"),
    "xacro_not_expanded": (*SHOW, "side.xacro"),
    "package_not_found": (*SHOW, "package.xacro"),
    "options_together": ("design", "--robot", "er3a", "--floor", "0", "--no-floor"),
    "option_not_used": ("diagnose", "--robot", "er3a", "--limits", "--trajectory", "t.csv", "--log", "two.csv"),
    "unknown_option": ("identify", "--log-file", "two.csv"),
    "not_numbers": ("design", "--robot", "er3a", "--home", "0;0"),
    "configuration_value": ("--config", "value.toml", "robots"),
    "configuration_key": ("--config", "key.toml", "robots"),
    "no_such_file": (*CHECK, "missing.csv"),
    "file_exists": ("view", ".", "--out", "there.html"),
    "other_file": ("predict", "--model", "payload.json", "--log", "two.csv"),
    "newer_version": ("predict", "--model", "newer.json", "--log", "two.csv"),
    "damaged_result": ("predict", "--model", "damaged.json", "--log", "two.csv"),
}
"""A command for each error, in the folder below."""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Files that cause the errors, in the working directory."""
    monkeypatch.chdir(tmp_path)
    wave = np.column_stack([np.sin(np.linspace(0.0, 6.0, 50) + k) for k in range(2)])
    write_log(tmp_path / "two.csv", Log(t=0.01 * np.arange(50), q=wave, tau=wave))
    six = ",".join([*(f"q{k}" for k in range(1, 7)), *(f"tau{k}" for k in range(1, 7))])
    rows = "\n".join(f"{0.01 * k:.2f}," + ",".join(["0.1"] * 12) for k in range(20))
    texts = {
        "unnamed.csv": f"Zeit,{six}\n{rows}\n",
        "run.xyz": "1",
        "empty.csv": "",
        "blank.csv": f"t,{six}\n" + "\n".join(f"{0.01 * k:.2f}" + "," * 12 for k in range(20)) + "\n",
        "unit.csv": f"# units: {{tau: Nm/rad}}\nt,{six}\n{rows}\n",
        "mapping.yaml": MAPPING,
        "branches.urdf": BRANCHES,
        "two.urdf": BRANCHES.replace('<parent link="base"/><child link="b"/>', '<parent link="a"/><child link="b"/>'),
        "broken.urdf": "<robot><link></robot>",
        "side.xacro": XACRO,
        "package.xacro": XACRO.replace("$(arg side)", "$(find nowhere)"),
        "value.toml": 'harmonics = "five"\n',
        "key.toml": 'frictoin = "polynomial"\n',
        "there.html": "",
        "newer.json": json.dumps({"format": "robot-oed model", "format_version": 99}),
        "damaged.json": json.dumps({"format": "robot-oed model", "format_version": 1}),
    }
    for name, text in texts.items():
        (tmp_path / name).write_text(text)
    (tmp_path / "nothing").mkdir()
    payload().save(tmp_path)
    return tmp_path


@pytest.mark.parametrize("name", COMMANDS)
def test_the_example_ends_with_the_code(name: str, run: Callable[..., Any], folder: Path) -> None:
    """One line, exit code 2, and the code of the table at its end."""
    if name in ("xacro_not_expanded", "package_not_found"):
        pytest.importorskip("xacro", reason="xacro is not installed")
    done = run(*COMMANDS[name])
    assert done.code == 2
    line = next(line for line in done.err.splitlines() if not line.startswith("note:"))
    assert line.startswith("oed: ")
    assert line.endswith(f"({ERROR_CODES[name]})"), line


def test_every_error_has_an_example() -> None:
    """No code is without a command that gives it, and none is given twice."""
    assert set(COMMANDS) == set(ERROR_CODES)
    assert len(ERROR_CODES) == len(ERRORS) == len({item.code for item in ERRORS})


def test_codes_of_errors_are_explained(run: Callable[..., Any]) -> None:
    """By code, in any spelling, or by name; and all are listed."""
    assert "--force" in run("explain", "OED-F002").out
    assert run("explain", "f002").out == run("explain", "file_exists").out
    assert run("explain", "f002", "--json").data["codes"][0]["name"] == "file_exists"
    listed = run("explain").out
    assert all(item.code in listed for item in ERRORS)
