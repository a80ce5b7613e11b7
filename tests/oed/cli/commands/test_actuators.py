"""``oed actuators`` and ``oed design --for actuators`` as their user calls them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from benchmarks.actuators_parts.plants import MACHINES, mjcf, multisine, play, random_truth

LEG = MACHINES["leg"]()


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a leg's MJCF, with and without laws, a log, and gains."""
    folder = tmp_path_factory.mktemp("leg")
    (folder / "leg.xml").write_text(mjcf(LEG))
    (folder / "motors.xml").write_text(mjcf(LEG, laws=False))
    (folder / "gains.yaml").write_text("law: pd\nkp: 20\nkd: 1\n")
    rng = np.random.default_rng(4)
    t, command = multisine(LEG, 2.0, rng, 0.004)
    q = play(LEG, random_truth(LEG, rng), t, command)
    columns = {"t": t} | {f"q{j + 1}": q[:, j] for j in range(3)} | {f"qref{j + 1}": command[:, j] for j in range(3)}
    table = pd.DataFrame(columns)
    table.to_csv(folder / "log.csv", index=False)
    table.drop(columns=["qref1", "qref2", "qref3"]).to_csv(folder / "positions.csv", index=False)
    swapped = table.rename(columns={"q1": "q3", "q3": "q1", "qref1": "qref3", "qref3": "qref1"})
    swapped.to_parquet(folder / "swapped.parquet")
    return folder


@pytest.mark.slow
def test_all_files_are_written(run, files: Path, tmp_path: Path) -> None:
    """The command writes results, simulator files and the report; --joints states the order of the log's joints."""
    out = tmp_path / "drives"
    words = ("actuators", "--robot", files / "motors.xml", "--gains", files / "gains.yaml", "--no-effects")
    done = run(*words, "--log", files / "log.csv", "--out", out, "--json")
    assert done.code == 0, done.err
    names = {"actuators.json", "motion.parquet", "parameters.csv", "report.html"}
    names |= {"drives.xml", "isaac_lab.py", "newton.json"}
    assert {path.name for path in out.iterdir()} == names
    first = json.loads((out / "actuators.json").read_text())
    assert first["errors"][0]["held_out"] < 0.2 * first["errors"][0]["held_out_described"]
    again = run(*words, "--log", files / "log.csv", "--out", out)
    assert (again.code, "exists" in again.err) == (2, True)
    joints = ("--joints", "calf_joint,thigh_joint,hip_joint")
    done = run(*words, "--log", files / "swapped.parquet", *joints, "--out", tmp_path / "swapped")
    assert done.code == 0, done.err
    second = json.loads((tmp_path / "swapped" / "actuators.json").read_text())
    assert [v["value"] for v in second["parameters"]] == pytest.approx([v["value"] for v in first["parameters"]])


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ("--robot", "motors.xml", "--log", "log.csv"),
            "control law of hip_joint, thigh_joint, calf_joint is not known",
        ),
        (("--robot", "leg.xml", "--log", "positions.csv"), "positions.csv: column qref1: no command"),
        (("--robot", "leg.xml", "--log", "log.csv", "--share", "knee"), "no joint's name contains 'knee'"),
        (("--robot", "leg.xml", "--log", "log.csv", "--free", "mass"), "no drive has a parameter 'mass'"),
        (("--robot", "leg.xml", "--log", "log.csv", "--payload", "3=1,0,0,0"), "--payload of log 3; allowed: 1 to 1"),
        (("--robot", "leg.xml", "--log", "log.csv", "--joints", "hip"), "there is no joint 'hip'"),
        (("--robot", "leg.xml", "--log", "log.csv", "--lock", "hip_joint"), "--lock hip_joint; allowed: name=value"),
    ],
)
def test_bad_input(run, files: Path, tmp_path: Path, words: tuple[str, ...], message: str) -> None:
    """Bad input is exit code 2 and one message, and nothing is written."""
    paths = {path.name: path for path in files.iterdir()}
    done = run("actuators", *(paths.get(word, word) for word in words), "--out", tmp_path / "drives")
    assert done.code == 2
    assert message in " ".join(done.err.split())
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_logs_of_commands_are_diagnosed_and_compared(run, files: Path, tmp_path: Path) -> None:
    """`oed diagnose` takes a log without torque; `oed compare` takes the drives of two logs, and refuses mixtures."""
    words = ("--robot", files / "leg.xml", "--log", files / "log.csv")
    done = run("diagnose", *words, "--out", tmp_path / "diagnosed", "--json")
    assert done.code == 0, done.err
    names = {"diagnosis.json", "actuators.json", "motion.parquet", "report.html"}
    assert {path.name for path in (tmp_path / "diagnosed").iterdir()} == names
    assert json.loads((tmp_path / "diagnosed" / "diagnosis.json").read_text())["verdict"] == "none"
    refused = run("diagnose", *words, "--urdf", tmp_path / "a.urdf", "--out", tmp_path / "other")
    assert (refused.code, "need logs with torque" in refused.err) == (2, True)
    table = pd.read_csv(files / "log.csv")
    table[len(table) // 2 :].to_csv(tmp_path / "second.csv", index=False)
    table[: len(table) // 2].to_csv(tmp_path / "first.csv", index=False)
    for name in ("first", "second"):
        words = ("--robot", files / "leg.xml", "--log", tmp_path / f"{name}.csv", "--no-effects")
        assert run("actuators", *words, "--out", tmp_path / name).code == 0
    done = run("compare", tmp_path / "first", tmp_path / "second", "--out", tmp_path / "compared")
    assert done.code == 0, done.err
    assert {path.name for path in (tmp_path / "compared").iterdir()} == {
        "compare.json",
        "parameters.csv",
        "report.html",
    }
    same = run("compare", tmp_path / "first", tmp_path / "first", "--out", tmp_path / "same")
    assert (same.code, "same log" in same.err) == (2, True)
    mixed = run("compare", tmp_path / "first", files / "leg.xml", "--out", tmp_path / "mixed")
    assert (mixed.code, "compare drives with drives" in " ".join(mixed.err.split())) == (2, True)


@pytest.mark.slow
def test_a_motion_for_drives(run, files: Path, tmp_path: Path) -> None:
    """Commands, expected errors and the page are written; options of other designs are refused."""
    words = ("design", "--for", "actuators", "--robot", files / "leg.xml", "--duration", "2.5")
    done = run(*words, "--out", tmp_path / "motion", "--home", "0,0.8,-1.6")
    assert done.code == 0, done.err
    assert {path.name for path in (tmp_path / "motion").iterdir()} == {"commands.csv", "design.json", "report.html"}
    refused = run(*words, "--criterion", "d", "--out", tmp_path / "other")
    assert (refused.code, "--criterion does not apply with --for actuators" in refused.err) == (2, True)
    refused = run("design", "--for", "drives", "--robot", "er3a", "--out", tmp_path / "other")
    assert (refused.code, "--for drives; allowed: dynamics, calibration, actuators" in refused.err) == (2, True)
