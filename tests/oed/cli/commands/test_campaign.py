"""``oed campaign`` and the virtual robot that plays it, as their user calls them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

SHORT = ("--cycles", 1, "--cycle-time", 100, "--warm-up", 20, "--duty", "20,100", "--cooling", 1, "--power-on", 20)


@pytest.fixture
def planned(run: Callable[..., Any], robot: Path, experiment: Path, tmp_path: Path) -> Path:
    """A short campaign of a small robot."""
    out = tmp_path / "campaign"
    done = run("campaign", "--robot", robot, "--design", experiment, "--out", out, *SHORT, "--json")
    assert done.code == 0, done.err
    assert done.data["cycles"] == 5
    return out


@pytest.mark.slow
def test_a_campaign_is_written_whole(run: Callable[..., Any], robot: Path, experiment: Path, planned: Path) -> None:
    """The folder has campaign.json, the report and one CSV a stage; it is not overwritten without --force."""
    assert {path.name for path in planned.iterdir()} == {
        "campaign.json",
        "report.html",
        "power_on.csv",
        "excitation.csv",
        "friction.csv",
        "warm_up_20.csv",
        "warm_up_100.csv",
    }
    page = (planned / "report.html").read_text()
    assert "Schedule" in page
    assert "respects all limits" in page
    again = run("campaign", "--robot", robot, "--design", experiment, "--out", planned, *SHORT)
    assert again.code == 2
    assert "the file exists" in again.err


@pytest.mark.slow
def test_a_campaign_and_its_stages_play(run: Callable[..., Any], robot: Path, planned: Path, tmp_path: Path) -> None:
    """Oed simulate plays the whole campaign, a log a cycle, and any of its stages."""
    done = run("simulate", "--campaign", planned, "--out", tmp_path / "logs", "--json")
    assert done.code == 0, done.err
    assert sorted(path.name for path in (tmp_path / "logs").iterdir()) == done.data["files"]
    assert len(done.data["files"]) == 5
    for stage in ("friction", "warm_up_20"):
        line = (
            "simulate",
            "--robot",
            robot,
            "--trajectory",
            planned / f"{stage}.csv",
            "--out",
            tmp_path / f"{stage}.csv",
        )
        assert run(*line).code == 0


@pytest.mark.slow
def test_without_a_design_a_quick_one_is_made(run: Callable[..., Any], robot: Path, tmp_path: Path) -> None:
    """Without --design the excitation comes from a quick search, and the summary says so."""
    done = run("campaign", "--robot", robot, "--cycles", 1, "--out", tmp_path / "campaign", "--workers", 1)
    assert done.code == 0, done.err
    assert "comes from a quick search" in done.out


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (("--cycles", -1), 2, "cycles"),
        (("--cycles", 0), 2, "empty"),
        (("--duty", "0,50"), 2, "duties"),
        (("--duty", "much"), 2, "--duty much"),
        (("--cycle-time", 0), 2, "cycle_time"),
        (("--cycle-time", 300.001), 2, "multiple"),
        (("--cycle-time", 60, "--warm-up", 59), 1, "too short"),
        (("--design", "nowhere"), 2, "design.json"),
        (("--torque-margin", 0.99), 1, "joint"),
    ],
)
def test_bad_input_is_reported_in_one_line(
    run: Callable[..., Any],
    robot: Path,
    experiment: Path,
    tmp_path: Path,
    arguments: tuple[object, ...],
    code: int,
    words: str,
) -> None:
    """Exit code 2 for bad input and 1 for what cannot be done, one message, nothing written."""
    design = () if "--design" in arguments else ("--design", experiment)
    done = run("campaign", "--robot", robot, *design, "--out", tmp_path / "out", "--quiet", *arguments)
    assert done.code == code, done.err
    assert words in done.err
    assert "Traceback" not in done.err
    assert len(done.err.strip().splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_a_joint_that_cannot_move_is_infeasible(run: Callable[..., Any], stuck: Path, tmp_path: Path) -> None:
    """A velocity limit of zero allows no friction sweep: exit code 1 with the joint."""
    done = run("campaign", "--robot", stuck, "--cycles", 0, "--cooling", 1, "--out", tmp_path / "out", "--quiet")
    assert done.code == 1
    assert "joint 2" in done.err


@pytest.mark.slow
def test_a_design_of_another_robot_is_refused(run: Callable[..., Any], experiment: Path, tmp_path: Path) -> None:
    """The design must be for the campaign's robot."""
    done = run("campaign", "--robot", "er3a", "--design", experiment, "--out", tmp_path / "out", "--quiet")
    assert done.code == 2
    assert "for two, not for er3a" in done.err


@pytest.mark.slow
def test_simulate_plays_one_thing(run: Callable[..., Any], robot: Path, planned: Path) -> None:
    """A trajectory and a campaign at once are bad input."""
    line = ("simulate", "--robot", robot, "--trajectory", planned / "friction.csv", "--campaign", planned)
    done = run(*line)
    assert done.code == 2
    assert "--trajectory and --campaign together" in " ".join(done.err.split())


@pytest.mark.slow
def test_run_plans_and_goes_on(run, robot, tmp_path):
    """With --run the campaign is planned once and played; other options than before are refused."""
    from oed.controllers import ControllerOptions, VirtualController
    from robots.loading import load_robot

    plan = ["campaign", "--robot", robot, "--cycles", 0, "--cooling", 1, "--cycle-time", 60, "--out", tmp_path / "c"]
    nobody = ["--run", "127.0.0.1", "--motion-port", 9, "--state-port", 9, "--transport", "tcp"]
    done = run(*plan, *nobody)
    assert done.code == 1
    assert "0 of 1 stages are recorded; the same command goes on" in done.err
    assert (tmp_path / "c" / "report.html").exists()
    for options, problem in (
        (["--cooling", 2], "planned with another --cooling: 1"),
        (["--seed", 3], "planned with another --seed: 0"),
        (["--duty", "50"], "planned with another --duty"),
        (["--force"], "--force with --run would plan the campaign again"),
    ):
        changed = run(*plan, *options, *nobody)
        assert (changed.code, problem in changed.err) == (2, True), changed.err
    options = ControllerOptions(transport="tcp", motion_port=0, state_port=0, speed=20.0, wait_for_points=True)
    with VirtualController(load_robot(robot), options=options) as controller:
        ports = ["--motion-port", controller.motion_port, "--state-port", controller.state_port]
        fast = ["--transport", "tcp", "--download", "--speed", 20, "--patience", 20]
        done = run(*plan, "--run", "127.0.0.1", *ports, *fast, "--json")
    assert done.code == 0, done.err
    assert [stage["file"] for stage in done.data["stages"]] == ["logs/001_friction.csv"]
    assert (tmp_path / "c" / "logs" / "001_friction.csv").exists()


def test_options_of_the_link_need_a_host(run, robot, tmp_path):
    """Without --run, options of the way to a controller are refused."""
    done = run("campaign", "--robot", robot, "--transport", "tcp", "--speed", 2, "--out", tmp_path / "c")
    assert (done.code, "--transport, --speed do not apply without --run" in done.err) == (2, True)
