"""What a designed experiment is as a motion: from the samples of its file alone, on robots of all kinds."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pinocchio as pin
import pytest
from scipy.interpolate import BPoly

from oed.experiments import Design
from oed.exports import read_trajectory
from robots.common.errors import InfeasibleError, InputError
from robots.loading import load_robot
from robots.robot import Robot
from tests.oed import flat

pytestmark = pytest.mark.slow

NAMES = ("er3a", "panda", "prismatic", "single", "narrow")
# Two more arms of turning joints; those above prove the same.
MORE = ("ur10", "seven")
SCALE = 0.02


@pytest.fixture(scope="module", params=[*NAMES, *(pytest.param(name, marks=pytest.mark.longer) for name in MORE)])
def design(request, designed) -> Design:
    return designed(request.param)


def test_rest_at_both_ends(design: Design) -> None:
    """The whole experiment starts and ends at rest, in one pose."""
    for end in (0, -1):
        np.testing.assert_allclose(design.motion.dq[end], 0, atol=1e-12)
        np.testing.assert_allclose(design.motion.ddq[end], 0, atol=1e-9)
    np.testing.assert_allclose(design.motion.q[0], design.motion.q[-1], atol=1e-9)


def test_uniform_period(design: Design) -> None:
    """The samples come at the controller's period, without exception."""
    np.testing.assert_allclose(np.diff(design.motion.t), design.robot.period, atol=1e-12)


def test_limits_at_one_kilohertz(design: Design) -> None:
    """Through the file's positions, velocities and accelerations, a quintic passes no limit at 1 kHz."""
    motion, limits = design.motion, design.robot.limits
    q = BPoly.from_derivatives(motion.t, np.stack([motion.q, motion.dq, motion.ddq], axis=1))
    t = np.arange(0, motion.t[-1], 1e-3)
    ddq = q.derivative(2)(t)
    assert np.all(q(t) >= limits.lower)
    assert np.all(q(t) <= limits.upper)
    assert np.all(np.abs(q.derivative()(t)).max(axis=0) <= limits.velocity)
    assert np.all(np.abs(ddq).max(axis=0) <= limits.acceleration)
    assert np.all(np.abs(np.diff(ddq, axis=0)).max(axis=0) / 1e-3 <= limits.jerk)


def test_own_check(design: Design) -> None:
    """The design's own margins are those of its samples, and none is negative."""
    assert design.success
    assert design.check() == design.margins
    motion, limits = design.motion, design.robot.limits
    stated = {(m.quantity, m.joint): m for m in design.margins}
    for joint in range(design.robot.n):
        at = int(np.abs(motion.dq[:, joint]).argmax())
        margin = stated["velocity", joint + 1]
        assert abs(margin.value) == abs(motion.dq[at, joint])
        assert margin.slack_fraction == pytest.approx(1 - abs(margin.value) / limits.velocity[joint])


def test_segments(design: Design) -> None:
    """The table covers the experiment without a gap, in order, in whole periods; strokes name their joint."""
    table, period = design.segments, design.robot.period
    edges = [table[0]["start"], *(s["end"] for s in table)]
    assert edges[0] == 0
    assert edges[-1] == pytest.approx(design.motion.t[-1], abs=1e-9)
    assert [s["start"] for s in table[1:]] == edges[1:-1]
    counts = np.array(edges) / period
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)
    kinds = [s["kind"] for s in table]
    assert kinds.count("fourier") == 1
    assert [s["joint"] for s in table if s["kind"] == "sinusoid"] == list(range(1, design.robot.n + 1))
    assert set(kinds) <= {"approach", "fourier", "sinusoid", "move"}


def test_strokes_reach_the_velocity_bound(design: Design) -> None:
    """In its stroke each joint alone moves, to its velocity bound both ways, or over all of a range that is short."""
    motion, limits = design.motion, design.robot.limits
    for segment in (s for s in design.segments if s["kind"] == "sinusoid"):
        inside = (motion.t > segment["start"] - 1e-9) & (motion.t < segment["end"] + 1e-9)
        joint = segment["joint"] - 1
        q, dq = motion.q[inside], motion.dq[inside]
        others = np.delete(np.ptp(q, axis=0), joint)
        np.testing.assert_allclose(others, 0, atol=1e-9)
        # A thousandth stays in reserve for what the controller does between the samples.
        fast = min(dq[:, joint].max(), -dq[:, joint].min()) >= 0.999 * limits.velocity[joint]
        whole = np.ptp(q[:, joint]) >= 0.999 * (limits.upper - limits.lower)[joint]
        assert fast or whole
        if design.robot.name == "narrow":
            assert fast == (joint == 0)
        else:
            assert fast


def pinocchio_columns(robot: Robot, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray, names: list[str]) -> np.ndarray:
    """The regressor's columns (N n, m) by their names, without our code."""
    model, parent = pin.Model(), 0
    model.gravity.linear = np.array(robot.chain.gravity)
    kinds = {"revolute": pin.JointModelRevoluteUnaligned, "prismatic": pin.JointModelPrismaticUnaligned}
    for joint in robot.chain.joints:
        placement = pin.SE3(np.array(joint.rotation), np.array(joint.translation))
        parent = model.addJoint(parent, kinds[joint.kind](np.array(joint.axis)), placement, joint.name)
    data, n = model.createData(), robot.n
    rigid = np.reshape(
        [pin.computeJointTorqueRegressor(model, data, *s) for s in zip(q, dq, ddq, strict=True)], (-1, 10 * n)
    )
    order = ["m", "mPx", "mPy", "mPz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz"]
    shapes = {"f1": np.tanh(dq / SCALE), "f2": dq, "f3": dq * np.abs(dq), "f4": dq**3, "Im": ddq}
    columns = []
    for name in names:
        kind, joint = name.split("_")[0], int(name.split("_")[1]) - 1
        if kind in shapes:
            column = np.zeros((len(q), n))
            column[:, joint] = shapes[kind][:, joint]
            columns.append(column.reshape(-1))
        else:
            columns.append(rigid[:, 10 * joint + order.index(kind)])
    return np.column_stack(columns)


@pytest.mark.parametrize(
    ("name", "friction"),
    [
        *((name, "coulomb-viscous") for name in NAMES),
        ("er3a", "polynomial"),
        *(pytest.param(name, "coulomb-viscous", marks=pytest.mark.longer) for name in MORE),
    ],
)
def test_quality_from_the_file(name: str, friction: str, designed, tmp_path: Path) -> None:
    """The stated condition numbers follow from the CSV alone, by pinocchio and tanh friction."""
    design = designed(name, friction)
    design.save(tmp_path)
    stated = json.loads((tmp_path / "design.json").read_text())
    table = pd.read_csv(tmp_path / "trajectory.csv", comment="#")
    n = design.robot.n
    q, dq, ddq = (np.column_stack([table[f"{x}{j + 1}"] for j in range(n)]) for x in ("q", "dq", "ddq"))
    (fourier,) = (s for s in stated["segments"] if s["kind"] == "fourier")
    rows = (table["t"].to_numpy() > fourier["start"] - 1e-6) & (table["t"].to_numpy() < fourier["end"] - 1e-6)
    parts = {"fourier": rows, "whole": np.ones(len(q), dtype=bool)}
    for quality in stated["quality"]:
        if quality["part"] in parts:
            inside = parts[quality["part"]]
            Y = pinocchio_columns(design.robot, q[inside], dq[inside], ddq[inside], stated["model"]["columns"])
            assert quality["samples"] == inside.sum()
            assert quality["cond_Y"] == pytest.approx(np.linalg.cond(Y), rel=1e-6)
            assert quality["log_det_YtY"] == pytest.approx(np.linalg.slogdet(Y.T @ Y)[1], rel=1e-6)
            least = np.linalg.svd(Y, compute_uv=False)[-1]
            assert quality["smallest_singular_value_Y"] == pytest.approx(least, rel=1e-6)


def test_columns_of_er3a(designed) -> None:
    """36 inertial and 4 rotor columns, with Coulomb and viscous friction 52, with the polynomial 64."""
    short, full = designed("er3a").base.names, designed("er3a", "polynomial").base.names
    assert (len(short), len(full)) == (52, 64)
    assert sum(name.startswith("Im_") for name in full) == 4
    assert sum(name[0] == "f" for name in full) == 24


def test_save_and_load(design: Design, tmp_path: Path) -> None:
    """What was saved is what is loaded."""
    design.save(tmp_path)
    loaded = Design.load(tmp_path, robot=design.robot)
    for name in ("t", "q", "dq", "ddq"):
        np.testing.assert_array_equal(getattr(loaded.motion, name), getattr(design.motion, name))
    assert loaded.to_dict() == design.to_dict()
    assert loaded.summary() == design.summary()
    with pytest.raises(InputError, match="exists"):
        design.save(tmp_path)


def test_trajectory_file_stands_alone(design: Design, tmp_path: Path) -> None:
    """The trajectory names its robot, period and criterion."""
    design.save(tmp_path)
    motion, metadata = read_trajectory(tmp_path / "trajectory.csv", n=design.robot.n)
    assert metadata["period"] == design.robot.period
    assert metadata["robot"] == (design.robot.origin or design.robot.name)
    assert metadata["criterion"] == "cond"
    assert len(motion) == len(design.motion)


def test_load_names_the_robot_itself(designed, tmp_path: Path) -> None:
    """A design of a catalogue robot is loaded by its folder alone; another robot is refused."""
    designed("er3a").save(tmp_path)
    assert Design.load(tmp_path).robot.name == "er3a"
    with pytest.raises(InputError, match=r"design\.json.*er3a, not for ur10"):
        Design.load(tmp_path, robot=load_robot("ur10"))


@pytest.mark.parametrize("text", ["", "{", "{}", "[]", '{"robot": {"origin": "er3a"}}', '{"robot": 1}'])
def test_load_damaged(text: str, tmp_path: Path) -> None:
    """A damaged design file is named."""
    (tmp_path / "design.json").write_text(text)
    with pytest.raises(InputError, match=r"design\.json"):
        Design.load(tmp_path)


def test_load_missing(tmp_path: Path) -> None:
    """A missing design file is named."""
    with pytest.raises(InputError, match=r"design\.json"):
        Design.load(tmp_path)


def test_frame_and_plot(design: Design) -> None:
    """The table has t and three columns a joint; the picture has a line a joint."""
    n, frame = design.robot.n, design.to_frame()
    assert frame.shape == (len(design.motion), 1 + 3 * n)
    assert list(frame.columns[: 1 + n]) == ["t", *(f"q{j + 1}" for j in range(n))]
    assert len(design.plot().lines) >= n
    assert "cond(Y)" in design.summary()


def test_no_room_to_move(robot_named, make_robot, tiny, brief) -> None:
    """A velocity limit of zero is infeasible, and the joint is named."""
    robot = make_robot("RRR", "stuck", velocity=np.array([1.0, 0.0, 1.0]))
    with pytest.raises(InfeasibleError, match=r"joint 2.*velocity limit") as caught:
        flat.design(robot, effort=tiny, solver=brief, workers=1)
    assert caught.value.joint == 2


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"criterion": "f"}, "criterion 'f'.*cond, cond-d, d"),
        ({"friction": "none"}, "friction.*polynomial"),
        ({"effort": "huge"}, "effort 'huge'.*quick"),
        ({"harmonics": 1}, "harmonics is 1"),
        ({"periods": 0}, "periods is 0"),
        ({"base_frequency": 0.0}, "base frequency"),
        ({"base_frequency": 0.3}, "period"),
        ({"velocity_fraction": 1.5}, "velocity fraction"),
        ({"time_limit": 0.0}, "time limit"),
        ({"seed": -1}, "seed is -1"),
        ({"home": [0.0]}, "home pose"),
        ({"home": [0.0, np.nan, 0.0]}, "joint 2.*home pose"),
        ({"home": [0.0, 9.0, 0.0]}, "joint 2.*home pose"),
    ],
)
def test_bad_options(options: dict, message: str, make_robot, tiny) -> None:
    """An option out of range is named with what is allowed, before any search."""
    with pytest.raises(InputError, match=message):
        flat.design(make_robot("RRR", "three"), **{"effort": tiny, "workers": 1, **options})


def test_home_and_no_strokes(make_robot, tiny, brief) -> None:
    """The experiment starts and ends where it is told, and leaves the strokes out on request."""
    home = [0.3, -0.4]
    robot = make_robot("RR", "two")
    design = flat.design(robot, home=home, strokes=False, periods=2, effort=tiny, solver=brief, workers=1)
    np.testing.assert_allclose(design.motion.q[[0, -1]], [home, home], atol=1e-9)
    assert [s["kind"] for s in design.segments] == ["approach", "fourier", "move"]
    assert design.segments[1]["end"] - design.segments[1]["start"] == pytest.approx(20.0)
    assert design.to_dict()["settings"]["home"] == home


def test_velocity_fraction(make_robot, tiny, brief) -> None:
    """A fraction of the velocity limits bounds the whole experiment."""
    robot = make_robot("RR", "two")
    design = flat.design(robot, velocity_fraction=0.5, periods=1, effort=tiny, solver=brief, workers=1)
    assert np.all(np.abs(design.motion.dq).max(axis=0) <= 0.5 * robot.limits.velocity)


def test_robot_without_acceleration_limits(tmp_path: Path, tiny, brief) -> None:
    """A bare URDF works: finite limits are assumed, kept, and said to be assumed."""
    joints = "".join(
        f'<joint name="j{i}" type="revolute"><parent link="l{i - 1}"/><child link="l{i}"/><origin xyz="0.3 0 0.1" '
        f'rpy="{1.57 * i} 0 0"/><axis xyz="0 0 1"/><limit lower="-2" upper="2" velocity="2" effort="50"/></joint>'
        f'<link name="l{i}"><inertial><mass value="2"/><origin xyz="0.1 0.02 0"/><inertia ixx="0.02" ixy="0" ixz="0" '
        f'iyy="0.03" iyz="0" izz="0.03"/></inertial></link>'
        for i in (1, 2)
    )
    path = tmp_path / "bare.urdf"
    path.write_text(f'<robot name="bare"><link name="l0"/>{joints}</robot>')
    design = flat.design(load_robot(path), periods=1, effort=tiny, solver=brief, workers=1)
    assert design.success
    # 4/s of the velocity limit.
    assert np.all(np.abs(design.motion.ddq).max(axis=0) <= 8.0)
    assert {"limits.acceleration", "limits.jerk"} <= set(design.to_dict()["assumed"])
