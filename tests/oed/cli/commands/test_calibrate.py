"""``oed calibrate`` and ``oed design --for calibration``: from the example's files to a calibrated robot."""

from __future__ import annotations

import json

import pytest

from oed.cli import main


def run(monkeypatch, capsys, *words):
    """Runs a command line; gives the exit code, output and errors."""
    monkeypatch.setattr("sys.argv", ["oed", *map(str, words)])
    with pytest.raises(SystemExit) as ended:
        main()
    out, err = capsys.readouterr()
    return ended.value.code, out, err


@pytest.fixture
def example(tmp_path, monkeypatch, capsys):
    code, out, _ = run(monkeypatch, capsys, "example", "--for", "calibration", "--out", tmp_path / "example")
    assert code == 0
    assert "oed calibrate --robot" in out
    return tmp_path / "example"


@pytest.mark.slow
def test_the_example_is_calibrated(example, tmp_path, monkeypatch, capsys):
    """The example's poses give all files, a held-out error near the noise, and a robot that a design takes."""
    words = (
        "--robot",
        example / "robot.yaml",
        "--poses",
        example / "poses.csv",
        "--held-out",
        example / "held_out.csv",
    )
    kinds = ("--kinds", "joint_zero,link_placement,eccentricity,joint_compliance", "--no-diagnosis")
    code, out, _ = run(monkeypatch, capsys, "calibrate", *words, *kinds, "--out", tmp_path / "out", "--json")
    assert code == 0
    data = json.loads(out)
    # Distances of a marker in three axes of 0.05 mm: 0.087 mm, and the error of forty poses.
    assert data["levels"]["held_out"] < 1.3e-4
    assert data["check"]["held_out"] < 1.3e-4
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {
        *("calibration.json", "report.html", "robot.urdf", "robot.xml", "robot.yaml"),
        *("dh_modified.csv", "dh_standard.csv", "joint_zeros.yaml"),
    }
    code, out, _ = run(
        *(monkeypatch, capsys, "design", "--robot", tmp_path / "out" / "robot.yaml", "--for", "calibration"),
        *("--poses", 8, "--no-collision", "--out", tmp_path / "poses"),
    )
    assert code == 0
    assert {path.name for path in (tmp_path / "poses").iterdir()} == {
        *("poses.csv", "trajectory.csv", "design.json", "report.html"),
    }
    assert "NOT CHECKED" in out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--kinds", "friction"), "unknown geometric error"),
        (("--lengths", "cm"), "'cm'"),
        (("--known", "tracker=1,2"), "--known tracker=1,2"),
        (("--known", "laser=0,0,0"), "'laser'"),
        (("--board", "8,6"), "--board 8,6"),
        (("--poses", "nothing.csv"), "no such file"),
    ],
)
def test_bad_options_are_refused(example, tmp_path, monkeypatch, capsys, words, message):
    """A wrong option ends with exit code 2, one message, and nothing written."""
    poses = () if "--poses" in words else ("--poses", example / "poses.csv")
    out = tmp_path / "out"
    code, _, err = run(
        monkeypatch, capsys, "calibrate", "--robot", example / "robot.yaml", *poses, *words, "--out", out
    )
    assert code == 2
    assert message in err
    assert not out.exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--poses", "20"), "--poses does not apply with --for dynamics"),
        (("--for", "calibration", "--harmonics", "3"), "--harmonics does not apply with --for calibration"),
        (("--for", "painting"), "--for painting"),
        (("--for", "calibration", "--measurement", "sonar"), "--measurement sonar"),
        (("--for", "calibration", "--view-towards", "1,0,0"), "--view-from"),
    ],
)
def test_options_of_another_purpose_are_refused(tmp_path, monkeypatch, capsys, words, message):
    """Options that do not go with the purpose of a design are refused by name."""
    code, _, err = run(monkeypatch, capsys, "design", "--robot", "er3a", *words, "--out", tmp_path / "out")
    assert code == 2
    assert message in err
