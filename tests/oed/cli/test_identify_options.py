"""What ``oed identify`` and ``oed predict`` write on request, and the foreign logs that they read."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pandas as pd
import pinocchio as pin
import pytest

from estimation import load_model
from estimation.estimators import ESTIMATORS
from estimation.exports import standard_parameters
from robots.regressor import TorqueModel
from robots.terms import RigidBody


@pytest.fixture
def identify(run, robot: Path, experiment: Path, tmp_path: Path):
    """Identify the small robot from its log with more options."""

    def call(*options: object):
        return run("identify", "--robot", robot, "--log", experiment / "log.csv", "--out", tmp_path / "out", *options)

    return call


def states(count: int = 20) -> np.ndarray:
    return np.random.default_rng(0).uniform(-2.0, 2.0, (3, count, 2))


@pytest.mark.slow
def test_urdf(identify, tmp_path: Path) -> None:
    """The URDF of --urdf loads in another program, which gives the torques of the model's bodies."""
    done = identify("--urdf", tmp_path / "arm.urdf", "--method", "consistent")
    assert done.code == 0, done.err
    assert str(tmp_path / "arm.urdf") in done.out
    model = load_model(tmp_path / "out")
    q, dq, ddq = states()
    rigid = TorqueModel(model.robot, (RigidBody(),))
    expected = rigid.torque(q, dq, ddq, standard_parameters(model).reshape(-1))
    arm = pin.buildModelFromUrdf(str(tmp_path / "arm.urdf"))
    data = arm.createData()
    found = np.array([pin.rnea(arm, data, *row) for row in zip(q, dq, ddq, strict=True)])
    # Digits of the file and rounding of two recursions, against the largest torque.
    assert np.abs(found - expected).max() < 1e-8 * np.abs(expected).max()


@pytest.mark.slow
def test_c_code(identify, tmp_path: Path) -> None:
    """The C of --c-code compiles and gives the model's torque."""
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        pytest.skip("no C compiler on the path")
    source, library = tmp_path / "arm.c", tmp_path / "arm.so"
    done = identify("--c-code", source)
    assert done.code == 0, done.err
    assert str(source) in done.out
    flags = ["-std=c99", "-O1", "-ffp-contract=off", "-fPIC", "-shared"]
    subprocess.run([compiler, *flags, str(source), "-o", str(library), "-lm"], check=True, capture_output=True)
    torque = ctypes.CDLL(str(library)).robot_torque
    q, dq, ddq = states()
    found = np.empty_like(q)
    for k in range(len(q)):
        out = (ctypes.c_double * 2)()
        torque(*((ctypes.c_double * 2)(*part[k]) for part in (q, dq, ddq)), out)
        found[k] = out[:]
    # Sums of some products of order ten, in another order.
    np.testing.assert_allclose(found, load_model(tmp_path / "out").torque(q, dq, ddq), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("kept", ["--urdf", "--c-code"])
def test_exports_never_overwrite(identify, kept: str, tmp_path: Path) -> None:
    """A file in the way of one export ends the command before anything is written, with the file's name."""
    files = {"--urdf": tmp_path / "arm.urdf", "--c-code": tmp_path / "arm.c"}
    files[kept].write_text("precious")
    done = identify(*(word for pair in files.items() for word in pair))
    assert done.code == 2
    assert files[kept].name in done.err
    assert "--force" in done.err
    assert [path.name for path in tmp_path.iterdir()] == [files[kept].name]
    assert files[kept].read_text() == "precious"


def test_prediction_report(run, experiment: Path, tmp_path: Path) -> None:
    """With --report there is a page with the torque, its band and the errors; a file in the way stops the command."""
    page, out = tmp_path / "p.html", tmp_path / "p.csv"
    command = ["predict", "--model", experiment, "--log", experiment / "log.csv", "--out", out, "--report", page]
    done = run(*command)
    assert done.code == 0, done.err
    text = page.read_text(encoding="utf-8")
    assert "95 % band" in text
    assert "of torque RMS [%]" in text
    out.unlink()
    again = run(*command)
    assert again.code == 2
    assert "p.html" in again.err
    assert not out.exists()


def test_band(run, experiment: Path, tmp_path: Path) -> None:
    """The table holds the limits of a band that contains some 95 % of what was logged, and hardly extrapolates."""
    out = tmp_path / "p.csv"
    done = run("predict", "--model", experiment, "--log", experiment / "log.csv", "--out", out, "--json")
    assert done.code == 0, done.err
    table = pd.read_csv(out, comment="#")
    bounds = [f"tau{joint}_{what}" for joint in (1, 2) for what in ("lower", "upper", "extrapolates")]
    assert list(table.columns) == ["t", "tau1", "tau2", *bounds]
    for joint in (1, 2):
        assert (table[f"tau{joint}_lower"] < table[f"tau{joint}"]).all()
        assert (table[f"tau{joint}"] < table[f"tau{joint}_upper"]).all()
        assert set(table[f"tau{joint}_extrapolates"]) <= {0.0, 1.0}
        assert table[f"tau{joint}_extrapolates"].mean() < 0.02
    # Left-out errors of the fit's own log; its thousands of samples remember some tens of milliseconds.
    assert all(0.9 < share < 0.99 for share in done.data["band95_coverage"])


@pytest.mark.slow
def test_all_methods(run, robot: Path, experiment: Path, tmp_path: Path) -> None:
    """With --method all every estimator is in the table, with an error on unseen data or a reason; the best is used."""
    out, short = tmp_path / "out", tmp_path / "short.csv"
    table = pd.read_csv(experiment / "log.csv", comment="#")
    table.iloc[: len(table) // 2].to_csv(short, index=False)
    done = run("identify", "--robot", robot, "--log", short, "--method", "all", "--out", out, "--json")
    assert done.code == 0, done.err
    methods = done.data["methods"]
    assert {row["method"] for row in methods} == set(ESTIMATORS)
    for row in methods:
        assert row["problem"] or all(0 < error < 1 for error in row["unseen"])
    assert load_model(out).provenance["method"] == methods[0]["method"]
    assert np.mean(methods[0]["unseen"]) == min(np.mean(row["unseen"]) for row in methods if not row["problem"])
    assert "Estimators" in (out / "report.html").read_text()


@pytest.mark.slow
def test_mapping(run, robot: Path, experiment: Path, tmp_path: Path) -> None:
    """A log in degrees, milliseconds and foreign names gives, by its mapping, the parameters of the log itself."""
    table = pd.read_csv(experiment / "log.csv", comment="#")
    foreign = pd.DataFrame(
        {
            "stamp": 1e3 * table["t"],
            **{f"A{j} pos": np.rad2deg(table[f"q{j}"]) for j in (1, 2)},
            **{f"A{j} torque": -table[f"tau{j}"] for j in (1, 2)},
        }
    )
    log, mapping = tmp_path / "foreign.csv", tmp_path / "mapping.yaml"
    foreign.to_csv(log, sep=";", index=False, float_format="%.17g")
    mapping.write_text(
        "time: {column: stamp, unit: ms}\n"
        "position: {columns: [A1 pos, A2 pos], unit: deg}\n"
        "torque: {columns: [A1 torque, A2 torque], sign: [-1, -1]}\n"
    )
    out = tmp_path / "out"
    done = run("identify", "--robot", robot, "--log", log, "--mapping", mapping, "--out", out)
    assert done.code == 0, done.err
    expected, found = load_model(experiment), load_model(out)
    assert found.names == expected.names
    # Degrees and milliseconds round the last digits, and the fit conditions them by some 1e4.
    assert (np.abs(found.values - expected.values) < 1e-3 * expected.standard_errors + 1e-9).all()
    bare = run("predict", "--model", out, "--log", log, "--mapping", mapping, "--out", tmp_path / "p.csv", "--json")
    assert bare.code == 0, bare.err
    assert max(bare.data["nrmse"]) < 0.1


@pytest.mark.slow
def test_torque_that_does_not_follow_from_the_motion(run, robot: Path, experiment: Path, tmp_path: Path) -> None:
    """A log in good order whose torque is noise is not bad input: code 1, with the reason, and nothing written."""
    table = pd.read_csv(experiment / "log.csv", comment="#")
    table[["tau1", "tau2"]] = np.random.default_rng(0).normal(scale=20.0, size=(len(table), 2))
    table.to_csv(tmp_path / "noise.csv", index=False)
    done = run("identify", "--robot", robot, "--log", tmp_path / "noise.csv", "--out", tmp_path / "out")
    assert done.code == 1, done.err
    assert "badly excited" in done.err
    assert [path.name for path in tmp_path.iterdir()] == ["noise.csv"]
