"""A payload on a SCARA, whose flange never tilts: no motion shows the height of its centre of mass."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from scipy.signal import lfilter

from estimation.payloads import identify_payload
from estimation.payloads.determination import missing_motion, never_shown
from estimation.payloads.mounts import Mount
from robots import load_robot
from robots.robot import Robot
from robots.signals import Log

MASS, CENTRE = 1.5, np.array([0.04, -0.02, -0.06])
NEVER = frozenset({"centre_z"})
_JOINT = (
    '<joint name="j{i}" type="{kind}"><parent link="l{p}"/><child link="l{i}"/><origin xyz="{x} 0 {z}"/>'
    '<axis xyz="0 0 1"/><limit lower="{low}" upper="{high}" velocity="4" effort="200"/></joint>'
)
_LINK = (
    '<link name="l{i}"><inertial><origin xyz="{c} 0 0"/><mass value="{m}"/>'
    '<inertia ixx=".02" iyy=".03" izz=".04" ixy="0" ixz="0" iyz="0"/></inertial></link>'
)


@pytest.fixture(scope="module")
def description(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A SCARA as a URDF: two horizontal links, a vertical axis in metres, and a wrist that turns about it."""
    joints = [("revolute", 0.0, 0.4, -2.0, 2.0), ("revolute", 0.35, 0.0, -2.2, 2.2)]
    joints += [("prismatic", 0.3, 0.0, -0.2, 0.0), ("revolute", 0.0, -0.1, -3.0, 3.0)]
    links = [(0.17, 6.0), (0.15, 4.0), (0.0, 1.5), (0.0, 0.5)]
    text = '<robot name="scara"><link name="l0"/>'
    for i, ((kind, x, z, low, high), (c, m)) in enumerate(zip(joints, links, strict=True), start=1):
        text += _LINK.format(i=i, c=c, m=m) + _JOINT.format(i=i, p=i - 1, kind=kind, x=x, z=z, low=low, high=high)
    path = tmp_path_factory.mktemp("scara") / "scara.urdf"
    path.write_text(text + "</robot>")
    return path


@pytest.fixture(scope="module")
def scara(description: Path) -> Robot:
    """The robot by its description."""
    return load_robot(str(description))


def log(description: Path, body: pin.Inertia | None, seed: int) -> Log:
    """Torques by pinocchio on a sum of sines of 20 s, with friction and 1 % of coloured noise."""
    model = pin.buildModelFromUrdf(str(description))
    if body is not None:
        model.inertias[model.njoints - 1] += body
    data, rng = model.createData(), np.random.default_rng(seed)
    t = np.arange(0, 20, 0.005)
    size, rate = np.array([0.7, 0.8, 0.05, 1.2]), 2 * np.pi / 20 * np.array([[3, 7], [4, 9], [5, 11], [6, 13]])
    middle = np.array([0.0, 0.3, -0.1, 0.0])
    phase = np.arange(4)[:, None] + np.arange(2)
    argument = t[:, None, None] * rate + phase
    q = middle + size * np.sin(argument).sum(axis=2) / 2
    dq = size * (rate * np.cos(argument)).sum(axis=2) / 2
    ddq = -size * (rate**2 * np.sin(argument)).sum(axis=2) / 2
    tau = np.array([pin.rnea(model, data, *row) for row in zip(q, dq, ddq, strict=True)])
    tau += np.array([4.0, 2.0, 6.0, 0.5]) * np.tanh(dq / 0.002) + np.array([3.0, 1.5, 30.0, 0.1]) * dq
    noise = lfilter([np.sqrt(1 - 0.81)], [1.0, -0.9], rng.normal(size=tau.shape), axis=0)
    return Log(t=t, q=q, tau=tau + 0.01 * tau.std(axis=0) * noise)


def test_only_the_height_of_the_centre_is_hidden(scara: Robot) -> None:
    """An arm with a wrist shows all; a SCARA on a tilted base hides the height, too."""
    assert never_shown(Mount(scara), None) == NEVER
    assert never_shown(Mount(scara), np.array([0.0, 4.0, -9.0])) == NEVER
    assert never_shown(Mount(load_robot("ur10")), None) == frozenset()


def test_no_advice_asks_for_what_the_arm_cannot_do(scara: Robot) -> None:
    """Gravity cannot turn along any axis of the flange; a wrist joint that stands is still named."""
    t = np.linspace(0, 20, 400)[:, None]
    q = np.sin(t * np.array([0.7, 0.9, 1.1, 1.3])) * np.array([1, 1, 0.1, 1])
    assert missing_motion(Mount(scara), q, None) == ""
    q[:, 3] = 0.1
    text = missing_motion(Mount(scara), q, None)
    assert "joint 4 (j4" in text
    assert "gravity" not in text


@pytest.mark.slow
def test_mass_and_the_horizontal_centre_come_with_intervals(description: Path, scara: Robot) -> None:
    """A log with and one without 1.5 kg; the height is marked, and files of controllers say that it is assumed."""
    body = pin.Inertia(MASS, CENTRE, np.diag([0.004, 0.005, 0.003]))
    found = identify_payload(log(description, body, 1), robot=scara, without=log(description, None, 2))
    for item, truth in zip(found.quantities[:3], (MASS, *CENTRE[:2]), strict=True):
        assert item.lower <= truth <= item.upper
    assert found.quantities[0].half_width < 0.1
    assert found.determined[:4] == (True, True, True, False)
    assert re.search(
        r"centre of mass z +not determined; assumed \S+ m, no motion of this robot shows it", found.summary()
    )
    assert found.to_dict()["quantities"][3]["ci95"] == [None, None]
    assert found.to_frame().loc["centre_z", ["lower", "upper"]].isna().all()
    assert "assumed, not determined by the logs: centre_z" in found.source


def test_a_joint_that_changes_nothing_is_no_remedy(scara: Robot) -> None:
    """A turn of a vertical first joint leaves all torques by a body as they are: it is not asked for."""
    still = np.zeros((400, 4)) + 0.1
    assert "joint 2 (" in missing_motion(Mount(scara, 2), still, None)
    assert "joint 1 (" not in missing_motion(Mount(scara, 2), still, None)
