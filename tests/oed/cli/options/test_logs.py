"""What the command line shows of logs, one text for all commands: payloads, and bases that stood otherwise."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from oed.cli.options.logs import KnownLogs
from robots.common.errors import InputError
from robots.signals import Log
from robots.terms.situations.flange_body import point_mass


def with_known_setup(logs: list[Log], payloads: Sequence[str] | None, gravities: Sequence[str] | None) -> list[Log]:
    """Logs with what is known of them."""
    return KnownLogs(payload=tuple(payloads or ()), gravity=tuple(gravities or ())).with_setup(logs)


@pytest.fixture
def three() -> list[Log]:
    """Three logs that state nothing."""
    return [Log(t=np.arange(3.0), q=np.zeros((3, 2))) for _ in range(3)]


def test_logs_are_reported_by_their_number(three: list[Log]) -> None:
    """A point mass and a field of gravity, each on its log; the others stay as they were."""
    first, second, third = with_known_setup(three, ["2=5,0,0,0.1"], ["2=0,-2.54,-9.48", "3=1,2,3"])
    assert first.payload is None
    assert first.gravity is None
    assert second.payload == pytest.approx(point_mass(5.0, (0.0, 0.0, 0.1)))
    assert second.gravity == pytest.approx([0.0, -2.54, -9.48])
    assert third.payload is None
    assert third.gravity == pytest.approx([1.0, 2.0, 3.0])


def test_without_a_number_all_logs_are_meant(three: list[Log]) -> None:
    """A log that another text names keeps its own; two texts without a number contradict each other."""
    logs = with_known_setup(three, ["5,0,0,0.1"], ["2=1,2,3", "0,-2.54,-9.48"])
    assert all(log.payload == pytest.approx(point_mass(5.0, (0.0, 0.0, 0.1))) for log in logs)
    for log, field in zip(logs, ([0, -2.54, -9.48], [1, 2, 3], [0, -2.54, -9.48]), strict=True):
        assert log.gravity == pytest.approx(field)
    with pytest.raises(InputError, match="without a number twice"):
        with_known_setup(three, None, ["1,2,3", "1,2,3"])


@pytest.mark.parametrize("option", ["--payload", "--gravity"])
@pytest.mark.parametrize(
    "text", ["2", "2=", "2=5,0", "x=0,0,0", "2=a,b,c", "2=0;0;0", "2=0,0,0,0,0", "=1,2,3", "1.5=1,2,3"]
)
def test_another_form_is_refused_with_an_example(three: list[Log], option: str, text: str) -> None:
    """The option, what was typed, and how it is typed."""
    known = ([text], None) if option == "--payload" else (None, [text])
    with pytest.raises(InputError) as caught:
        with_known_setup(three, *known)
    assert f"{option} {text}" in str(caught.value)
    assert "NUMBER=" in str(caught.value)


@pytest.mark.parametrize(
    ("gravities", "words"),
    [
        (["4=0,0,-9.81"], "1 to 3"),
        (["0=0,0,-9.81"], "1 to 3"),
        (["1=0,0,1", "1=0,0,2"], "twice"),
        (["1=0,nan,0"], "finite"),
    ],
)
def test_a_log_that_is_not_there_or_a_value_that_is_none_is_refused(
    three: list[Log], gravities: list[str], words: str
) -> None:
    """A number beyond the logs, a log reported twice, a number that is not finite."""
    with pytest.raises(InputError, match=words):
        with_known_setup(three, None, gravities)


@pytest.mark.slow
def test_commands_count_what_they_are_reported(run, robot: Path, experiment: Path, tmp_path: Path) -> None:
    """Identify notes the gravity in its model, predict uses it, and a wrong one ends with code 2 and one line."""
    log, out = experiment / "log.csv", tmp_path / "out"
    plain = ("identify", "--robot", robot, "--log", log)
    level = "1=0,0,-9.81"
    done = run(*plain, "--gravity", level, "--payload", "1=0,0,0,0", "--out", out, "--json")
    assert done.code == 0, done.err
    assert json.loads((out / "model.json").read_text())["provenance"]["gravities"] == []
    first, second = tmp_path / "one.csv", tmp_path / "two.csv"
    assert run("predict", "--model", out, "--log", log, "--out", first).code == 0
    assert run("predict", "--model", out, "--log", log, "--payload", "1=2,0,0,0.1", "--out", second).code == 0
    assert first.read_text() != second.read_text()
    for command in (
        (*plain, "--out", tmp_path / "no"),
        ("predict", "--model", out, "--log", log, "--out", tmp_path / "no.csv"),
        ("diagnose", "--robot", robot, "--log", log, "--out", tmp_path / "no"),
    ):
        refused = run(*command, "--gravity", "2=0,0,-9.81")
        assert refused.code == 2
        assert "--gravity of log 2" in refused.err
        assert "Traceback" not in refused.err
    assert run("diagnose", "--robot", robot, "--limits", "--gravity", level).code == 2
