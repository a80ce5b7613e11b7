"""``oed compare`` from the command line: results, order, and bad input."""

from __future__ import annotations

import json

import numpy as np
import pytest

from estimation import identify, load_model
from robots import load_robot
from robots.plants import Sensors, nominal_plant, simulate
from robots.signals import Motion

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two logs and two models of one er3a with little noise, in folders with dates."""
    place = tmp_path_factory.mktemp("compare")
    robot = load_robot("er3a")
    plant = nominal_plant(robot, spread=0.1, seed=1, sensors=Sensors(torque_noise=0.01))
    t = 0.008 * np.arange(1250)
    phase = 2 * np.pi * np.outer(t, 0.1 * np.arange(1, 6))
    a, b = np.random.default_rng(0).normal(size=(2, 5, 6)) * 0.12
    w = 2 * np.pi * 0.1 * np.arange(1, 6)[:, None]
    s, c = np.sin(phase), np.cos(phase)
    motion = Motion(t=t, q=s @ a - c @ b, dq=c @ (a * w) + s @ (b * w), ddq=c @ (b * w**2) - s @ (a * w**2))
    for day in (1, 2):
        log = simulate(plant, motion, seed=day)
        target = place / f"2026-03-0{day}"
        target.mkdir()
        header = ",".join(["t", *(f"q{j}" for j in range(1, 7)), *(f"tau{j}" for j in range(1, 7))])
        table = np.column_stack([log.t, log.q, log.tau])
        np.savetxt(target / "log.csv", table, delimiter=",", header=header, comments="", fmt="%.9g")
        identify(robot, log, friction="coulomb-viscous", check=False).model.save(target / "model.json")
    return place


def test_models_are_compared_in_order_of_their_dates(run, folder, tmp_path):
    """Models in dated folders are compared by date; compare.json, model.json and report.html are written."""
    done = run("compare", folder / "2026-03-02", folder / "2026-03-01", "--out", tmp_path / "out", "--json")
    assert done.code == 0
    assert [item["label"] for item in done.data["runs"]] == ["2026-03-01", "2026-03-02"]
    assert [item["date"] for item in done.data["runs"]] == ["2026-03-01 00:00", "2026-03-02 00:00"]
    assert json.loads((tmp_path / "out" / "compare.json").read_text()) == done.data
    page = (tmp_path / "out" / "report.html").read_text()
    assert done.data["verdict"] in page
    assert "Friction of the runs" in page
    merged = load_model(tmp_path / "out")
    assert merged.provenance["merged"]["runs"] == ["2026-03-01", "2026-03-02"]
    assert run("compare", folder / "2026-03-02", folder / "2026-03-01", "--out", tmp_path / "out").code == 2


def test_merged_model_predicts(run, folder, tmp_path):
    """`oed predict` takes the merged model, with bands."""
    assert run("compare", folder / "2026-03-01", folder / "2026-03-02", "--out", tmp_path / "out").code == 0
    log = folder / "2026-03-02" / "log.csv"
    done = run("predict", "--model", tmp_path / "out", "--log", log, "--out", tmp_path / "p.csv")
    assert done.code == 0
    assert "tau1_lower" in (tmp_path / "p.csv").read_text()


def test_logs_are_identified_and_compared(run, folder, tmp_path):
    """With --robot, logs are identified one by one and compared."""
    logs = [folder / f"2026-03-0{day}" / "log.csv" for day in (1, 2)]
    done = run("compare", *logs, "--robot", "er3a", "--friction", "coulomb-viscous", "--out", tmp_path / "out")
    assert done.code == 0
    assert "No difference is significant" in done.out
    assert done.out.count("Joint ") == 6


def test_bad_input_is_refused_in_one_message(run, folder, tmp_path):
    """One model, a model twice, a log without --robot, a model with --robot, and a missing file end with code 2."""
    model, log, out = folder / "2026-03-01", folder / "2026-03-01" / "log.csv", ("--out", tmp_path / "out")
    for arguments, message in (
        ((model,), "1 model to compare; allowed: two or more"),
        ((model, model), "are the same model"),
        ((log, model), "is no model.json and no folder that holds one; to compare logs, give --robot"),
        ((model, log, "--robot", "er3a"), "is a model, but --robot is given"),
        ((model, tmp_path / "none.json"), "no such file"),
        ((model, folder / "2026-03-02", "--false-alarms", "2"), "false-alarm rate 2.0; allowed: between 0 and 0.5"),
    ):
        done = run("compare", *arguments, *out)
        assert done.code == 2
        assert message in " ".join(done.err.split())
        assert "Traceback" not in done.err
    assert not (tmp_path / "out").exists()
