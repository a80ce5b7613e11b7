"""The diagnosis from the command line."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from estimation.logs import read_log, write_log
from estimation.models.model import load_model
from oed.exports import read_trajectory
from robots.loading import load_robot
from robots.plants import load_plant, simulate
from robots.signals import Motion

pytestmark = pytest.mark.slow

PLANT = """
effects:
  - {effect: friction_step, joint: 2, parameters: {coulomb_step: 2.5, viscous_step: 1.0, change_time: MOMENT}}
"""


def moment(experiment: Path) -> float:
    """When the second joint is fastest, in the middle third of the experiment: friction that changes shows at once."""
    motion = read_trajectory(experiment / "trajectory.csv")[0]
    third = len(motion) // 3
    return float(motion.t[third + int(np.argmax(np.abs(motion.dq[third : 2 * third, 1])))])


@pytest.fixture(scope="module")
def logs(robot: Path, experiment: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Play the experiment on a robot whose second joint is damaged in full motion: two logs, the last unseen."""
    folder = tmp_path_factory.mktemp("logs")
    motion = read_trajectory(experiment / "trajectory.csv")[0]
    (folder / "plant.yaml").write_text(PLANT.replace("MOMENT", f"{moment(experiment)}"))
    plant = load_plant(folder / "plant.yaml", load_robot(robot))
    write_log(folder / "first.csv", simulate(plant, motion, seed=1))
    later = Motion(motion.t + 60.0, motion.q[::-1], -motion.dq[::-1], motion.ddq[::-1])
    write_log(folder / "second.csv", simulate(plant, later, seed=2))
    return folder


@pytest.fixture(scope="module")
def done(robot: Path, logs: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Diagnose the logs once: a folder of results."""
    from typer.testing import CliRunner

    from oed.cli.app import app

    out = tmp_path_factory.mktemp("diagnosed")
    line = ["diagnose", "--robot", robot, "--log", logs / "first.csv", "--held-out", logs / "second.csv", "--out", out]
    result = CliRunner().invoke(app, [str(part) for part in line])
    assert result.exit_code == 0, result.output
    assert "friction_step (joint 2)" in result.output
    return out


def test_a_hidden_damage_is_named(done: Path, experiment: Path) -> None:
    """The file names the damage that the plant had, its joint and its time, and the gain on the unseen log."""
    data = json.loads((done / "diagnosis.json").read_text())
    assert data["verdict"] == "named"
    (finding,) = data["findings"]
    assert (finding["effect"], finding["joint"]) == ("friction_step", 2)
    values = {parameter["name"]: parameter["value"] for parameter in finding["parameters"]}
    assert values["change_time"] == pytest.approx(moment(experiment), abs=0.2)
    assert values["coulomb_step"] == pytest.approx(2.5, rel=0.3)
    assert finding["gain"]["nrmse_after"] < finding["gain"]["nrmse_before"]
    assert {"effect", "joint", "detectable", "attributable"} <= set(data["limits"][0])


def test_its_files_are_of_use(done: Path) -> None:
    """The model can be loaded again with its extension, and the page names the finding."""
    model = load_model(done / "model.json")
    assert [extension.effect for extension in model.extensions] == ["friction_step"]
    page = (done / "report.html").read_text()
    assert "sudden change of friction" in page
    assert "Simulated motion" in page
    assert "smallest effect size" in page


def test_limits_before_any_experiment(run, robot: Path, experiment: Path, tmp_path: Path) -> None:
    """With --limits, a trajectory alone shows what it could show, and what it could not."""
    line = ("diagnose", "--limits", "--robot", robot, "--trajectory", experiment / "trajectory.csv", "--out", tmp_path)
    result = run(*line, "--json")
    assert result.code == 0, result.err
    limits = {(limit["effect"], limit["joint"]): limit for limit in result.data["limits"]}
    assert 0 < limits["stribeck", 2]["detectable"] < 0.2
    assert limits["encoder_offset", 1]["detectable"] is None
    assert sorted(path.name for path in tmp_path.iterdir()) == ["limits.json", "report.html"]
    again = run(*line)
    assert again.code == 2
    assert "--force" in again.err
    louder = run(*line, "--noise", 0.1, "--force", "--json")
    changed = {(limit["effect"], limit["joint"]): limit for limit in louder.data["limits"]}
    assert changed["stribeck", 2]["detectable"] == pytest.approx(5 * limits["stribeck", 2]["detectable"], rel=1e-3)


def test_limits_by_an_identified_model(run, robot: Path, experiment: Path, tmp_path: Path) -> None:
    """An identified model stands in for the description."""
    line = ["diagnose", "--limits", "--robot", robot, "--trajectory", experiment / "trajectory.csv"]
    result = run(*line, "--model", experiment / "model.json", "--out", tmp_path, "--json")
    assert result.code == 0, result.err
    assert any(np.isfinite(limit["detectable"] or np.inf) for limit in result.data["limits"])


def test_an_extended_model_is_a_model_like_any_other(
    run, done: Path, logs: Path, robot: Path, experiment: Path, tmp_path: Path
) -> None:
    """`oed predict`, `simulate`, `design` and the limits take it, and say where the extension cannot count."""
    model, motion = done / "model.json", experiment / "trajectory.csv"
    predicted = run("predict", "--model", model, "--log", logs / "second.csv", "--out", tmp_path / "p.csv", "--json")
    assert predicted.code == 0, predicted.err
    played = run("simulate", "--robot", robot, "--trajectory", motion, "--model", model, "--out", tmp_path / "log.csv")
    assert played.code == 0, played.err
    log, known = read_log(tmp_path / "log.csv"), load_model(model)
    states = read_trajectory(motion)[0]
    expected = known.torque(states.q, states.dq, states.ddq, states.t)
    assert np.abs(expected - known.torque(states.q, states.dq, states.ddq)).max() > 1.0
    # The log has 2 % of noise.
    assert np.sqrt(np.mean((log.tau - expected) ** 2)) < 0.03 * np.sqrt(np.mean(expected**2))
    planned = run("design", "--robot", robot, "--after", model, "--effort", "quick", "--out", tmp_path / "next")
    assert planned.code == 0, planned.err
    assert "NOT included in the torque limits" in planned.out
    assert "friction_step of joint 2" in planned.out
    line = ("diagnose", "--limits", "--robot", robot, "--trajectory", motion, "--model", model)
    limits = run(*line, "--out", tmp_path / "limits", "--json")
    assert limits.data["extensions_not_counted"] == ["friction_step of joint 2"]


def test_a_model_takes_the_place_of_a_plant(run, done: Path, logs: Path, experiment: Path, tmp_path: Path) -> None:
    """Both together, or a model of another robot, end with code 2 and the reason."""
    line = ("simulate", "--trajectory", experiment / "trajectory.csv", "--model", done / "model.json")
    both = run(*line, "--plant", logs / "plant.yaml", "--out", tmp_path / "log.csv")
    assert both.code == 2
    assert "--plant and --model together" in " ".join(both.err.split())
    assert not (tmp_path / "log.csv").exists()


def test_a_model_knows_its_robot(run, done: Path, experiment: Path, tmp_path: Path) -> None:
    """A motion whose file names no robot is played on the model's own; without a model, a robot is asked for."""
    bare = tmp_path / "bare.csv"
    pd.read_csv(experiment / "trajectory.csv", comment="#").to_csv(bare, index=False)
    line = ("simulate", "--trajectory", bare, "--out", tmp_path / "log.csv")
    nobody = run(*line)
    assert nobody.code == 2
    assert "--robot" in nobody.err
    played = run(*line, "--model", done / "model.json", "--json")
    assert played.code == 0, played.err
    assert played.data["robot"] == load_model(done / "model.json").robot.name


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "give --log"),
        (("--limits",), "--limits needs --trajectory"),
        (("--limits", "--log", "a.csv", "--trajectory", "b.csv"), "--limits needs --trajectory"),
        (("--log", "a.csv", "--trajectory", "b.csv"), "give --log"),
        (("--log", "nowhere.csv"), "nowhere.csv"),
        (("--limits", "--trajectory", "nowhere.csv"), "nowhere.csv"),
    ],
)
def test_bad_use_is_reported(arguments, message, run, robot: Path, tmp_path: Path) -> None:
    """A call that means nothing, and files that are not there, end with code 2, the reason, and no file."""
    result = run("diagnose", "--robot", robot, *arguments, "--out", tmp_path / "out")
    assert result.code == 2
    assert message in result.err.replace("\n", " ")
    assert "Traceback" not in result.err
    assert not (tmp_path / "out").exists()


@pytest.mark.longer
def test_logs_with_clocks_of_their_own(data: Callable[[str], Path], run: Callable[..., Any], tmp_path: Path) -> None:
    """Logs that overlap are put one after the other as --own-clocks does, and that is said; one log twice is refused.

    One of the folder's four rings in saturation and shows nothing of the arm: it is left out, and that is said.
    """
    folder = data("simple_pendulum_dfki")
    line = ["diagnose", "--robot", folder / "simple_pendulum.urdf", "--log", folder]
    texts = []
    for name, clocks in (("alone", ()), ("reported", ("--own-clocks",))):
        done = run(*line, "--out", tmp_path / name, *clocks)
        assert done.code == 0, done.err
        assert "hand_guiding" in done.out
        assert "Log 4 (sysid) is left out" in done.out
        texts.append(done.out.replace("\n", " "))
    assert "The logs overlap in time" in texts[0]
    assert "overlap" not in texts[1]
    copied = run(*line, "--held-out", sorted(folder.glob("*.parquet"))[0], "--out", tmp_path / "copy")
    assert copied.code == 2
    assert "one of the logs" in copied.err.replace("\n", " ")
    assert not (tmp_path / "copy").exists()
