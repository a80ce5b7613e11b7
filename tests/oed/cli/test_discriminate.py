"""``oed design --discriminate``."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from oed.exports import read_trajectory
from robots.loading import load_robot

PAIR = "stribeck:2,load_dependent_friction:2"


@pytest.mark.slow
def test_trajectory_design_and_report_are_written(run: Callable[..., Any], robot: Path, tmp_path: Path) -> None:
    """The command writes the motion, within the limits, its chance, and a page that names the rivals."""
    done = run("design", "--robot", robot, "--discriminate", PAIR, "--noise", "0.3,0.2", "--out", tmp_path, "--json")
    assert done.code == 0, done.err
    data = json.loads((tmp_path / "design.json").read_text())
    assert data["kind"] == done.data["kind"]
    assert data["noise"] == [0.3, 0.2]
    motion = read_trajectory(tmp_path / "trajectory.csv", n=2)[0]
    assert not [margin for margin in load_robot(robot).limits.margins(motion) if margin.violated]
    assert "load dependent friction of joint 2" in (tmp_path / "report.html").read_text()


def test_a_criterion_does_not_apply(run: Callable[..., Any], robot: Path, tmp_path: Path) -> None:
    """Options of the usual search are refused beside it, by name, and nothing is written."""
    done = run("design", "--robot", robot, "--discriminate", PAIR, "--criterion", "d", "--out", tmp_path / "no")
    assert done.code == 2
    assert "--criterion does not apply with --discriminate" in done.err
    assert not (tmp_path / "no").exists()


@pytest.mark.slow
def test_errors_have_their_codes(run: Callable[..., Any], robot: Path, tmp_path: Path) -> None:
    """An unknown effect is bad input; an effect that shows in no motion cannot be done; no traceback, no files."""
    for rivals, code, part in (
        ("stribeckk:2,spring:2", 2, "did you mean 'stribeck'"),
        ("stribeck:7,spring:2", 2, "allowed: 1, 2"),
        ("encoder_offset:1,spring:1", 1, "second base pose"),
    ):
        done = run("design", "--robot", robot, "--discriminate", rivals, "--out", tmp_path / "no")
        assert done.code == code, done.err
        assert part in done.err
        assert "Traceback" not in done.err
    assert not (tmp_path / "no").exists()
