"""Friction and heat from the command line: logs of a virtual robot that warms up in minutes."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimation.logs import write_log
from estimation.models.model import load_model
from estimation.thermal import thermal_from_dict
from oed.exports import read_trajectory
from robots.loading import load_robot
from robots.plants import load_plant, simulate
from robots.plants.heat import heat_piece, reference_friction
from robots.signals import Log, Motion

pytestmark = pytest.mark.slow

PLANT = """
sensors: {torque_noise: 0.01}
thermal:
  thermometers: none
  joints:
    1: {model: second, alpha: -0.01, K1: 0.6, K2: 0.5, C1: 12, C2: 60}
    2: {model: second, alpha: -0.015, K1: 0.4, K2: 0.4, C1: 8, C2: 40}
"""


def repeated(motion: Motion, duration: float, start: float) -> Motion:
    """Repeats a motion at 10 ms for a while, from a time on the campaign's clock."""
    step = max(1, round(0.01 / float(np.median(np.diff(motion.t)))))
    q, dq, ddq = (np.asarray(x)[::step] for x in (motion.q, motion.dq, motion.ddq))
    t = np.arange(0.0, duration, 0.01)
    index = np.arange(len(t)) % len(q)
    return Motion(start + t, q[index], dq[index], ddq[index])


@pytest.fixture(scope="module")
def logs(robot: Path, experiment: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two runs of four minutes with a rest of four between them, and three short ones, cooling down."""
    folder = tmp_path_factory.mktemp("warm")
    (folder / "plant.yaml").write_text(PLANT)
    plant = load_plant(folder / "plant.yaml", load_robot(robot))
    assert plant.heat is not None
    motion = read_trajectory(experiment / "trajectory.csv")[0]
    plan = ((240.0, 0.0, 1.0), (240.0, 480.0, 0.5), (15.0, 780.0, 0.0), (15.0, 840.0, 0.0))
    motions = [repeated(motion, duration, start) for duration, start, _ in plan]
    pieces = [heat_piece(m, reference_friction(plant.model, plant.parameters, m)) for m in motions]
    warmth = plant.heat.follow(pieces)
    (folder / "logs").mkdir()
    for k, (m, (_, _, duty)) in enumerate(zip(motions, plan, strict=True)):
        log = simulate(plant, m, seed=k, warmth=warmth)
        reported: dict[str, Any] = {"run": 1 + round(2 * (1 - duty)), "duty": duty} if duty else {}
        write_log(folder / "logs" / f"{k}.parquet", replace(log, metadata=reported))
    return folder / "logs"


@pytest.fixture(scope="module")
def done(robot: Path, logs: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Fit the logs once: a folder of results."""
    from typer.testing import CliRunner

    from oed.cli.app import app

    out = tmp_path_factory.mktemp("thermal")
    line = ["thermal", "--robot", robot, "--log", logs, "--ambient", 20, "--out", out]
    result = CliRunner().invoke(app, [str(part) for part in line])
    assert result.exit_code == 0, result.output
    assert "slow / fast" in result.output
    assert "only the ratios of alpha to heat exchanges" in result.output
    return out


def test_the_model_predicts_cold_and_warm(done: Path, robot: Path, logs: Path) -> None:
    """model.json is a model like any other, with a thermal model a joint that has the true time constants."""
    data = json.loads((done / "model.json").read_text())
    model = load_model(done)
    ttm = thermal_from_dict(model, data)
    assert ttm is not None
    truth = load_plant(logs.parent / "plant.yaml", load_robot(robot)).heat
    assert truth is not None
    for fitted, true in zip(ttm.thermal, truth.models, strict=True):
        assert fitted is not None
        assert true is not None
        # Ten minutes of two joints at 1 % of noise: some percent, and the fast one is a few bins long.
        assert fitted.time_constants(5.0)[0] == pytest.approx(true.time_constants(5.0)[0], rel=0.25)


def test_predictions_follow_the_heat(run: Callable[..., Any], done: Path, logs: Path, tmp_path: Path) -> None:
    """The last log, 14 minutes in, is predicted better after the logs before it than as a cold start; both are said."""
    errors = []
    for options, reported in (
        ((), "assumed cold"),
        (("--before", logs / "0.parquet", "--before", logs / "1.parquet"), "2 earlier logs"),
    ):
        ended = run(
            "predict", "--model", done, "--log", logs / "2.parquet", "--ambient", 20, "--out", tmp_path / "tau.csv",
            *options, "--force", "--json",
        )  # fmt: skip
        assert ended.code == 0, ended.err
        assert reported in ended.data["heat"]
        errors.append(ended.data["error_rms"])
    # The band is that of ten minutes; a quarter of a minute, warm and slower, may differ by some percent.
    assert np.all(np.abs(np.array(ended.data["band95_coverage"]) - 0.95) < 0.05)
    assert np.all(np.array(errors[1]) < 0.9 * np.array(errors[0]))


def test_what_warmed_the_robot_needs_a_model_with_heat(
    run: Callable[..., Any], done: Path, experiment: Path, logs: Path, tmp_path: Path
) -> None:
    """--before with a model without heat, or with logs that come later, is refused with code 2."""
    line = ("predict", "--log", logs / "0.parquet", "--before", logs / "1.parquet", "--out", tmp_path / "tau.csv")
    for model, message in ((experiment, "the model has no thermal part"), (done, "overlap in time")):
        ended = run(*line, "--model", model)
        assert ended.code == 2
        assert message in ended.err
    assert not (tmp_path / "tau.csv").exists()


def test_the_page_shows_time_powers_and_curves(done: Path) -> None:
    """The page has friction against time, by duty cycle, time constants, and friction curves cold to warm."""
    page = (done / "report.html").read_text()
    for name in ("friction_time", "friction_duty", "time_constants", "friction_curves"):
        assert name in page
    assert "These logs determine time constants and friction ratios, but not" in page


def test_results_are_not_overwritten(run: Callable[..., Any], done: Path, robot: Path, logs: Path) -> None:
    """A folder with results is kept without --force, reported before anything is computed."""
    ended = run("thermal", "--robot", robot, "--log", logs, "--out", done)
    assert ended.code == 2
    assert "--force" in ended.err or "exists" in ended.err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--order", "third"), "unknown thermal model"),
        (("--joint", 3), "1 to 2"),
        (("--alpha", 0.01), "a negative number"),
        (("--ambient", 293.15), "kelvin"),
    ],
)
def test_wrong_options_are_reported(
    run: Callable[..., Any], robot: Path, logs: Path, tmp_path: Path, options: tuple[Any, ...], message: str
) -> None:
    """An unknown model, a joint that is not there, a rising friction and kelvins end with one message and code 2."""
    ended = run("thermal", "--robot", robot, "--log", logs / "0.parquet", "--out", tmp_path / "out", *options)
    assert ended.code == 2
    assert message in ended.err
    assert "Traceback" not in ended.err
    assert not (tmp_path / "out").exists()


def test_a_robot_at_rest_is_reported(run: Callable[..., Any], robot: Path, tmp_path: Path) -> None:
    """Logs without motion end with code 1 or 2 and one message."""
    t = np.arange(0.0, 20.0, 0.01)
    rng = np.random.default_rng(0)
    write_log(tmp_path / "still.csv", Log(t=t, q=np.zeros((len(t), 2)), tau=rng.normal(size=(len(t), 2))))
    ended = run("thermal", "--robot", robot, "--log", tmp_path / "still.csv", "--out", tmp_path / "out")
    assert ended.code in (1, 2)
    assert ended.err.count("\n") <= 3
    assert "Traceback" not in ended.err
