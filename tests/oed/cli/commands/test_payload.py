"""``oed payload``, and the options that state a payload."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from robots.geometry.inertia import inertial_parameters
from robots.terms.situations.flange_body import point_mass
from tests.oed.cli.conftest import ROBOT

BODY = inertial_parameters(1.5, [0.02, -0.01, 0.08], np.diag([0.004, 0.005, 0.003]), np.eye(4))


@pytest.fixture
def payload_file(tmp_path: Path) -> Path:
    """A payload.json with what other commands read of it."""
    file = tmp_path / "payload.json"
    file.write_text(json.dumps({"format": "robot-oed payload", "format_version": 1, "parameters": BODY.tolist()}))
    return file


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "words"),
    [
        ((), "--without LOG, of the same path without the payload, or --model"),
        (("--without", "LOG", "--model", "MODEL"), "--without and --model together"),
        (("--without", "LOG"), "no robot"),
        (("--without", "LOG", "--robot", "ur10", "--payload", "5,0,0,0.1"), "--payload without a number beside"),
        (("--model", "MODEL", "--to", "fanuc"), "urscript, franka, kuka, ros, urdf"),
        (("--model", "MODEL", "--frame", "0,0"), "X,Y,Z"),
        (("--model", "MODEL", "--frame", "0,0,x"), "numbers"),
        (("--model", "nowhere.json"), "no such file"),
        (("--model", "MODEL", "--robot", "ur10"), "6, as ur10 has"),
        (("--model", "MODEL", "--robot", "OTHER"), "the flange of two is elsewhere than that of the model's robot"),
    ],
)
def test_bad_options_end_with_one_message_and_no_folder(
    run, experiment: Path, tmp_path: Path, options: tuple, words: str
) -> None:
    """Exit code 2, one line, and nothing written."""
    other = tmp_path / "other.yaml"
    other.write_text(ROBOT.replace("VELOCITY", "2").replace("a: 0.1", "a: 0.15"))
    names = {"LOG": experiment / "log.csv", "MODEL": experiment, "OTHER": other}
    out = tmp_path / "out"
    done = run("payload", "--log", experiment / "log.csv", *(names.get(o, o) for o in options), "--out", out)
    assert done.code == 2
    assert words in done.err
    assert "Traceback" not in done.err
    assert not out.exists()


@pytest.mark.slow
def test_a_log_that_does_not_tell_the_payload_ends_with_code_1(run, experiment: Path, tmp_path: Path) -> None:
    """Two joints cannot show a payload's centre; the message names a motion, and nothing is written."""
    out = tmp_path / "out"
    done = run("payload", "--model", experiment, "--log", experiment / "log.csv", "--out", out)
    assert done.code == 1, done.err
    assert "does not determine the payload's" in done.err
    assert not out.exists()


@pytest.mark.slow
def test_two_logs_give_a_payload_a_report_and_controller_files(run, tmp_path: Path) -> None:
    """Simulated with `--payload`, found by `payload`, written for controllers, used by `predict`."""
    from oed.exports import write_trajectory
    from robots.loading import load_robot
    from robots.signals import Motion

    robot = load_robot("ur10")
    t = 0.008 * np.arange(2000)
    w = 2 * np.pi * np.array([[0.11, 0.13, 0.17, 0.19, 0.23, 0.29], [0.31, 0.37, 0.41, 0.43, 0.47, 0.53]])
    amplitude = np.array([[0.8] * 6, [0.3] * 6])
    phase = t[:, None, None] * w
    q, dq, ddq = (
        (amplitude * part).sum(axis=1) for part in (np.sin(phase), w * np.cos(phase), -(w**2) * np.sin(phase))
    )
    path = tmp_path / "trajectory.csv"
    write_trajectory(path, Motion(t, q, dq, ddq), {"robot": "ur10", "period": robot.period})
    free, loaded = tmp_path / "free.csv", tmp_path / "loaded.csv"
    simulate = ("simulate", "--robot", "ur10", "--trajectory", path, "--out")
    assert run(*simulate, free, "--seed", 1).code == 0
    assert run(*simulate, loaded, "--payload", "1.5,0.02,-0.01,0.08", "--seed", 2).code == 0
    out = tmp_path / "payload"
    command = ("payload", "--robot", "ur10", "--log", loaded, "--without", free, "--out", out)
    done = run(*command, "--to", "urscript,kuka", "franka", "ros", "--to", "urdf", "--json")
    assert done.code == 0, done.err
    data = done.data
    files = {"payload.script", "load_data.dat", "endeffector-config.json", "payload_parameters.yaml", "payload.urdf"}
    assert {file.name for file in out.iterdir()} == {"payload.json", "report.html", *files}
    assert json.loads((out / "payload.json").read_text()) == data
    mass, *centre = data["quantities"][:4]
    # The noise is 2 % of the torque: 16 s show the mass to a per cent.
    assert mass["value"] == pytest.approx(1.5, rel=0.03)
    assert [item["value"] for item in centre] == pytest.approx([0.02, -0.01, 0.08], abs=0.005)
    page = (out / "report.html").read_text()
    assert "<h1>Payload</h1>" in page
    assert "ur10" in page
    again = run(*command)
    assert again.code == 2
    assert "--force" in again.err


@pytest.mark.slow
@pytest.mark.parametrize("text", ["1.5,0.02,-0.01,0.08", "1=1.5,0.02,-0.01,0.08"])
def test_predict_takes_a_payload_without_the_logs_number(run, experiment: Path, tmp_path: Path, text: str) -> None:
    """One log needs no number, and the torque differs from that without the payload."""
    first, second = tmp_path / "one.csv", tmp_path / "two.csv"
    command = ("predict", "--model", experiment, "--log", experiment / "log.csv", "--out")
    assert run(*command, first).code == 0
    assert run(*command, second, "--payload", text).code == 0
    assert first.read_text() != second.read_text()


@pytest.mark.slow
def test_predict_reads_a_payload_file(run, experiment: Path, payload_file: Path, tmp_path: Path) -> None:
    """A payload.json counts with its inertia."""
    first, second = tmp_path / "one.csv", tmp_path / "two.csv"
    command = ("predict", "--model", experiment, "--log", experiment / "log.csv", "--out")
    assert run(*command, first, "--payload", payload_file).code == 0
    centre = ",".join(map(str, BODY[1:4] / BODY[0]))
    assert run(*command, second, "--payload", f"1.5,{centre}").code == 0
    assert first.read_text() != second.read_text()


@pytest.mark.slow
def test_simulate_adds_the_payloads_torque(run, robot: Path, experiment: Path, tmp_path: Path) -> None:
    """The second joint of the small robot carries 2 kg, 0.3 m out: gravity's moment is that of the closed form."""
    from estimation import read_log
    from robots.loading import load_robot

    logs = []
    for name, options in (("a", ()), ("b", ("--payload", "2,0.3,0,0"))):
        out = tmp_path / f"{name}.csv"
        done = run("simulate", "--robot", robot, "--trajectory", experiment / "trajectory.csv", "--out", out, *options)
        assert done.code == 0, done.err
        logs.append(read_log(out, n=2))
    known = load_robot(robot)
    pose = known.chain.flange(logs[0].q)
    lever = pose[:, :3, :3] @ np.array([0.3, 0.0, 0.0])
    axis = known.chain.transforms(logs[0].q)[:, 1, :3, 2]
    # A body's weight turns about the joint's axis through the flange's origin, which lies on it.
    moment = np.einsum("ti,ti->t", axis, np.cross(lever, np.array([0.0, 0.0, -2 * 9.81])))
    rest = slice(0, 5)
    noise = 0.05 * np.abs(logs[1].tau[:, 1]).max()
    assert np.mean(logs[1].tau[rest, 1] - logs[0].tau[rest, 1]) == pytest.approx(-np.mean(moment[rest]), abs=noise)


@pytest.mark.slow
def test_a_body_that_cannot_exist_is_refused(run, robot: Path, experiment: Path, tmp_path: Path) -> None:
    """A negative mass, by `simulate` and by `design`."""
    for command in (
        ("simulate", "--robot", robot, "--trajectory", experiment / "trajectory.csv", "--out", tmp_path / "x.csv"),
        ("design", "--robot", robot, "--effort", "quick", "--out", tmp_path / "d"),
    ):
        done = run(*command, "--payload=-2,0,0,0.1")
        assert done.code == 2
        assert "mass of -2 kg" in done.err


def test_options_without_a_meaning_for_a_payload_are_refused(run, robot: Path, tmp_path: Path) -> None:
    """`--payload-only` counts the arm as known."""
    done = run("design", "--robot", robot, "--payload-only", "--essential", "0.1", "--out", tmp_path / "d")
    assert done.code == 2
    assert "--essential does not apply with --payload-only" in done.err


def test_a_point_mass_is_what_four_numbers_say() -> None:
    """The closed form of its inertia about the flange."""
    x, y, z = 0.1, -0.2, 0.3
    expected = [2, 2 * x, 2 * y, 2 * z, 2 * (y**2 + z**2), -2 * x * y, -2 * x * z]
    np.testing.assert_allclose(point_mass(2.0, (x, y, z))[:7], expected)
