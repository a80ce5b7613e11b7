"""Programs of KUKA and ABB: they parse, check the start, move to it slowly, and play the path in its time."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from oed.exports import CONTROLLER_FORMS, ExportOptions, export_trajectory
from oed.exports.forms.controller_programs import LONGEST_ARRAY
from oed.exports.forms.sampling import at_period
from robots.common.errors import AssumedValueWarning, InputError
from robots.joints.controller_axes import ControllerAxes
from robots.loading import load_robot
from robots.robot import Robot
from robots.signals import Motion
from tests.oed.exports.languages import Krl, ParseError, Rapid

NAME = ExportOptions(name="excite", start_tolerance=0.02)

AXES = ControllerAxes(
    sign=np.array([-1.0, 1, 1, -1, 1, -1]),
    zero=np.deg2rad([0.0, -90, 90, 0, 0, 0]),
    coupling=np.where(np.arange(36).reshape(6, 6) == 13, -1.0, 0.0),
)
"""As of a KUKA arm whose third axis contains the second."""


@pytest.fixture(scope="module")
def er3a() -> Robot:
    """Load an arm and state how its controller counts."""
    return replace(load_robot("er3a"), axes=AXES)


def motion_of(robot: Robot, duration: float = 6.0) -> Motion:
    """A motion of several waves, at rest at both ends."""
    t = 0.004 * np.arange(round(duration / 0.004) + 1)
    e, w = np.pi / t[-1], 2.0
    window = np.sin(e * t) ** 4
    rise, bend = np.gradient(window, t), np.gradient(np.gradient(window, t), t)
    s, c = np.sin(w * t), np.cos(w * t)
    size = np.linspace(0.3, 0.1, robot.n)
    q = robot.limits.home + np.outer(window * s, size)
    dq = np.outer(rise * s + window * w * c, size)
    return Motion(t, q, dq, np.outer(bend * s + 2 * rise * w * c - window * w * w * s, size))


def test_krl_program(er3a: Robot, tmp_path: Path) -> None:
    """Start check and HALT before a slow PTP, then a spline whose points are the trajectory at their times."""
    motion = motion_of(er3a)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        export_trajectory(tmp_path / "excite.src", motion, er3a, "kuka", options=NAME)
    text = (tmp_path / "excite.src").read_text()
    program = Krl(text)
    assert program.name == "EXCITE"
    kinds = program.order
    assert kinds.index("IF") < kinds.index("HALT") < kinds.index("PTP") < kinds.index("PTP_SPLINE") == len(kinds) - 1
    assert "IF FAR>1.1459 THEN" in text
    assert text.index("#VEL_PTP,10)") < text.index("PTP START") < text.index("#VEL_PTP,100)")
    axes = np.array(program.points)
    assert set(program.parts) == {1.0}
    assert len(axes) == len(program.parts) + 1
    assert program.time == pytest.approx(6.0)
    times = np.linspace(0.0, program.time, len(axes))
    sign, zero = np.array([-1, 1, 1, -1, 1, -1]), np.array([0, -90, 90, 0, 0, 0])
    coupled = motion.q.copy()
    coupled[:, 2] -= motion.q[:, 1]
    wanted = np.rad2deg(coupled) * sign + zero
    spline = CubicSpline(times, axes, bc_type="clamped")(motion.t)
    assert np.abs(spline - wanted).max() < np.rad2deg(2e-3)
    assert 0.04 <= times[1] <= 0.2


def test_krl_rests(er3a: Robot, tmp_path: Path) -> None:
    """A rest is a wait between two splines: no piece of a spline is without length, and no time is lost."""
    one = motion_of(er3a, 4.0)
    rest = np.zeros((500, er3a.n))
    q = np.concatenate([one.q, np.tile(one.q[-1], (500, 1)), one.q[1:]])
    dq, ddq = (np.concatenate([part, rest, part[1:]]) for part in (one.dq, one.ddq))
    motion = Motion(0.004 * np.arange(len(q)), q, dq, ddq)
    export_trajectory(tmp_path / "excite.src", motion, er3a, "kuka", options=NAME)
    content = (tmp_path / "excite.src").read_bytes()
    program = Krl(content.decode())
    assert program.order[-3:] == ["PTP_SPLINE", "WAIT", "PTP_SPLINE"]
    assert 1.6 < program.waits[-1] <= 2.0
    t, read = CONTROLLER_FORMS["kuka"].read(content, er3a, ".src")
    assert program.time + program.waits[-1] == pytest.approx(t[-1])
    assert t[-1] == pytest.approx(motion.duration, abs=t[1])
    assert (np.abs(np.diff(program.points, axis=0)).max(axis=1) > 0).all()
    np.testing.assert_allclose(read, at_period(motion, t[1]).q, atol=1e-7)


def test_krl_list_is_cut(er3a: Robot, tmp_path: Path) -> None:
    """Beyond 32,767 samples the list has a second array; each array is as long as it says."""
    motion = motion_of(er3a)
    long = Motion(motion.t, motion.q, motion.dq, motion.ddq)
    export_trajectory(tmp_path / "excite.dat", long, er3a, "kuka", options=NAME, period=0.00018)
    program = Krl((tmp_path / "excite.dat").read_text())
    assert program.arrays == {"POINT": LONGEST_ARRAY, "POINT_2": 33335 - LONGEST_ARRAY}
    assert len(program.points) == 33335


def test_rapid_module(er3a: Robot, tmp_path: Path) -> None:
    """Start check and Stop before a slow MoveAbsJ to a fine point, then one timed move a point, the last one fine."""
    motion = motion_of(er3a)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        export_trajectory(tmp_path / "excite.mod", motion, er3a, "abb", options=NAME)
    text = (tmp_path / "excite.mod").read_text()
    module = Rapid(text)
    assert (module.name, module.procedures) == ("EXCITE", ["EXCITE_PLAY"])
    kinds = module.order
    assert kinds.index("IF") < kinds.index("STOP") < kinds.index("MOVEABSJ") < kinds.index("FOR")
    assert "IF far>1.1459 THEN" in text
    count = len(module.targets["POINTS"])
    first, inner, last = module.moves
    assert first == ["POINTS{1}", "\\NOEOFFS", "V50", "FINE", "TOOL0"]
    assert inner == ["POINTS{I}", "\\NOEOFFS", "VMAX", "\\T:=PERIOD", "Z50", "TOOL0"]
    assert last == [f"POINTS{{{count}}}", "\\NOEOFFS", "VMAX", "\\T:=PERIOD", "FINE", "TOOL0"]
    axes = np.array(module.targets["POINTS"])
    np.testing.assert_allclose(AXES.joints(np.deg2rad(axes))[[0, -1]], motion.q[[0, -1]], atol=1e-8)


@pytest.mark.parametrize(
    ("form", "suffix", "name", "problem"),
    [
        ("kuka", ".src", "if", "reserved word of KRL"),
        ("kuka", ".src", "Endspline", "reserved word of KRL"),
        ("kuka", ".src", "a" * 25, "25 characters; allowed: up to 24"),
        ("kuka", ".dat", "_a", "a letter, then letters"),
        ("abb", ".mod", "trap", "reserved word of RAPID"),
        ("abb", ".mod", "a" * 28, "28 characters; allowed: up to 27"),
        ("abb", ".mod", "main", "reserved word of RAPID"),
    ],
)
def test_names(form: str, suffix: str, name: str, problem: str, er3a: Robot, tmp_path: Path) -> None:
    """Reserved words, long names and names that begin otherwise are refused, and so is a file of another name."""
    with pytest.raises(InputError, match=problem):
        export_trajectory(tmp_path / f"{name}{suffix}", motion_of(er3a), er3a, form, options=ExportOptions(name=name))
    with pytest.raises(InputError, match=rf"the name of its file.*name the file other{suffix}, or state --name {name}"):
        export_trajectory(
            tmp_path / f"{name}{suffix}", motion_of(er3a), er3a, form, options=ExportOptions(name="other")
        )
    assert list(tmp_path.iterdir()) == []


def test_axes_that_are_not_stated(tmp_path: Path) -> None:
    """Without signs, zeros and couplings the file has the joints, and a note says so."""
    robot = load_robot("er3a")
    with pytest.warns(AssumedValueWarning, match="controller_axes in a robot YAML"):
        export_trajectory(tmp_path / "excite.src", motion_of(robot), robot, "kuka", options=NAME)
    start = Krl((tmp_path / "excite.src").read_text()).points[0]
    np.testing.assert_allclose(start, np.rad2deg(robot.limits.home), atol=1e-7)


def test_axes_of_a_file(tmp_path: Path) -> None:
    """A robot file states signs, zeros and couplings; the way back gives the joints."""
    text = "{name: two, geometry: {convention: modified, joints: [{}, {}]}, controller_axes: "
    path = tmp_path / "two.yaml"
    path.write_text(text + "{sign: [1, -1], zero: [0, 90], couplings: [{axis: 2, joint: 1, factor: -1}]}}")
    axes = load_robot(path).axes
    assert axes is not None
    np.testing.assert_allclose(np.rad2deg(axes.axes(np.deg2rad([[10.0, 30.0]]))), [[10.0, 70.0]])
    q = np.random.default_rng(0).uniform(-2, 2, (5, 2))
    np.testing.assert_allclose(axes.joints(axes.axes(q)), q, atol=1e-12)
    for wrong, problem in (
        ("{sign: [1, 2]}", "controller_axes.sign.*allowed: 1 or -1"),
        ("{couplings: [{axis: 1, joint: 3, factor: 1}]}", "two of 2 joints"),
        ("{couplings: [{axis: 1, joint: 2, factor: 1}, {axis: 2, joint: 1, factor: 1}]}", "do not determine"),
        ("{zero: [0, 1], unit: m}", "unit"),
        ("{sgin: [1, 1]}", "sgin"),
    ):
        path.write_text(text + wrong + "}")
        with pytest.raises(InputError, match=problem):
            load_robot(path)


@pytest.mark.parametrize(
    ("language", "text"),
    [
        (Krl, "DEF a( )\nIF FAR>1 THEN\nEND\n"),
        (Krl, "DEF a( )\nPTP_SPLINE\n  SPTP {A1 1.0}\nENDSPLINE\nEND\n"),
        (Krl, "DEFDAT a PUBLIC\nDECL E6AXIS P[1]\nP[1]={A2 1.0}\nENDDAT\n"),
        (Krl, "DEF a( )\nHALT\nDECL INT i\nEND\n"),
        (Rapid, "MODULE a\n  CONST num period:=1\nENDMODULE\n"),
        (Rapid, "MODULE a\n  CONST jointtarget p{2}:=[[[1,2,3,4,5,6],[9E9,9E9,9E9,9E9,9E9,9E9]]];\nENDMODULE\n"),
        (Rapid, "MODULE a\n  PROC b()\n    FOR i FROM 1 TO 2 DO\n  ENDPROC\nENDMODULE\n"),
    ],
)
def test_parsers_refuse(language: type[Krl] | type[Rapid], text: str) -> None:
    """The parsers of these tests see what is wrong."""
    with pytest.raises(ParseError):
        language(text)
