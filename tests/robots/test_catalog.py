"""The robots that come with this software."""

from __future__ import annotations

import hashlib
import re

import numpy as np
import pytest
import yaml

from robots.common.errors import AssumedValueWarning
from robots.loading import CATALOG, catalogue, load_robot

pytestmark = pytest.mark.filterwarnings(f"ignore::{AssumedValueWarning.__module__}.{AssumedValueWarning.__name__}")

ER3A_URDF_JOINTS = [
    ("0 0 .3215", "0 0 0"),
    (".05 0 0", f"{np.pi / 2!r} {-np.pi / 2!r} 0"),
    (".27 0 0", "0 0 0"),
    (".07 -.299 0", f"{np.pi / 2!r} 0 0"),
    ("0 0 0", f"{-np.pi / 2!r} 0 0"),
    ("0 -.078 0", f"{np.pi / 2!r} 0 0"),
]


@pytest.fixture
def er3a():
    return load_robot("er3a")


@pytest.fixture
def er3a_model(er3a, tmp_path):
    """The same arm in pinocchio, from its URDF form, with the nominal links."""
    pin = pytest.importorskip("pinocchio", reason="pinocchio is the oracle of this test")
    links = yaml.safe_load((CATALOG / "er3a.yaml").read_text())["dynamics"]["links"]
    parts = ['<robot name="er3a"><link name="l0"/>']
    for i, ((xyz, rpy), link) in enumerate(zip(ER3A_URDF_JOINTS, links, strict=True), 1):
        moments = zip(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), link["inertia_at_com"], strict=True)
        inertia = " ".join(f'{key}="{float(value)!r}"' for key, value in moments)
        com = " ".join(str(value) for value in link["com"])
        parts.append(
            f'<link name="l{i}"><inertial><origin xyz="{com}"/><mass value="{link["mass"]}"/><inertia {inertia}/>'
            f'</inertial></link><joint name="J{i}" type="revolute"><parent link="l{i - 1}"/><child link="l{i}"/>'
            f'<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="0 0 1"/>'
            '<limit lower="-7" upper="7" velocity="1" effort="1"/></joint>'
        )
    path = tmp_path / "er3a.urdf"
    path.write_text("".join([*parts, "</robot>"]))
    return pin, pin.buildModelFromUrdf(str(path))


def test_the_catalogue_has_these_robots():
    """The catalogue offers the ER3A, the UR10 and the Panda."""
    assert set(catalogue()) >= {"er3a", "panda", "ur10"}


@pytest.mark.parametrize("name", catalogue())
def test_every_robot_loads_whole(name):
    """Every robot of the catalogue has its name, positive masses, finite limits and a digest."""
    robot = load_robot(name)
    assert (robot.name, robot.origin) == (name, name)
    assert re.fullmatch("[0-9a-f]{64}", robot.digest)
    assert (robot.inertia[:, 0] > 0.0).all()
    for bound in (robot.limits.lower, robot.limits.upper, robot.limits.velocity):
        assert np.isfinite(bound).all()
    for bound in (robot.limits.acceleration, robot.limits.jerk, robot.limits.torque):
        assert np.isfinite(bound).all()
        assert (bound > 0.0).all()


@pytest.mark.parametrize("name", catalogue())
def test_every_robots_inertia_is_physical(name):
    """Every nominal link has a positive definite pseudo-inertia (Wensing et al. 2018), up to rounding."""
    for row in load_robot(name).inertia:
        m, h, (xx, xy, xz, yy, yz, zz) = row[0], row[1:4], row[4:]
        inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        second = 0.5 * np.trace(inertia) * np.eye(3) - inertia
        pseudo = np.block([[second, h[:, None]], [h[None, :], np.array([[m]])]])
        assert np.linalg.eigvalsh(pseudo)[0] > -1e-6 * m


@pytest.mark.parametrize("name", ["panda", "ur10"])
def test_shipped_urdfs_state_their_source_and_licence(name):
    """A URDF of others is shipped with its source and licence, without meshes and without machine paths."""
    text, urdf = (CATALOG / f"{name}.yaml").read_text(), (CATALOG / f"{name}.urdf").read_text()
    assert yaml.safe_load(text)["licence"]
    assert "example-robot-data 6.0.0" in yaml.safe_load(text)["credit"]
    for word in ("<visual", "<collision", "mesh filename", "package://"):
        assert word not in urdf


def test_the_er3a_stands_as_drawn(er3a):
    """At zero the wrist is at (349, 0, 661.5) mm and the flange at (427, 0, 661.5) mm, looking along +x."""
    poses, flange = er3a.chain.transforms(np.zeros(6)), er3a.chain.flange(np.zeros(6))
    np.testing.assert_allclose(poses[4][:3, 3], [0.349, 0.0, 0.6615], atol=1e-15)
    np.testing.assert_allclose(flange[:3, 3], [0.427, 0.0, 0.6615], atol=1e-15)
    np.testing.assert_allclose(flange[:3, 2], [1.0, 0.0, 0.0], atol=1e-15)


def test_the_er3a_points_down(er3a):
    """With joint 5 at -90 degrees the tool points straight down, 78 mm below the wrist."""
    flange = er3a.chain.flange([0, 0, 0, 0, -np.pi / 2, 0])
    np.testing.assert_allclose(flange[:3, 2], [0.0, 0.0, -1.0], atol=1e-15)
    np.testing.assert_allclose(flange[:3, 3], [0.349, 0.0, 0.6615 - 0.078], atol=1e-15)


@pytest.mark.slow
def test_the_er3a_reaches_as_far_as_stated(er3a):
    """The wrist's largest horizontal reach is 627.1 mm; the data sheet says 628."""
    q2 = np.linspace(er3a.limits.lower[1], er3a.limits.upper[1], 551)
    q3 = np.linspace(er3a.limits.lower[2], er3a.limits.upper[2], 431)
    q = np.zeros((q2.size, 6))
    q[:, 1] = q2
    reach = 0.0
    # a step of 0.4 degree misses the largest value by less than 627 mm * (0.4 deg)^2 / 2 = 0.016 mm
    for value in q3:
        q[:, 2] = value
        reach = max(reach, float(er3a.chain.transforms(q)[:, 4, 0, 3].max()))
    assert reach == pytest.approx(0.6271, abs=5e-5)


def test_the_er3a_is_its_urdf_form(er3a, er3a_model):
    """The Denavit-Hartenberg table and the URDF form give the same kinematics and inertia, by pinocchio."""
    pin, model = er3a_model
    data = model.createData()
    for q in np.random.default_rng(1).uniform(er3a.limits.lower, er3a.limits.upper, size=(20, 6)):
        pin.forwardKinematics(model, data, q)
        expected = [data.oMi[i].homogeneous for i in range(1, 7)]
        np.testing.assert_allclose(er3a.chain.transforms(q), expected, rtol=0.0, atol=1e-12)
    rows = np.array([model.inertias[i].toDynamicParameters() for i in range(1, 7)])
    np.testing.assert_allclose(er3a.inertia, rows[:, [0, 1, 2, 3, 4, 5, 7, 6, 8, 9]], rtol=0.0, atol=1e-12)


def test_the_er3as_limits_and_drives(er3a):
    """Limits are in SI units, and rotor inertia is the motor's times the square of the gear ratio."""
    np.testing.assert_allclose(np.rad2deg(er3a.limits.lower), [-167, -130, -71, -180, -113, -360], rtol=1e-15)
    np.testing.assert_allclose(np.rad2deg(er3a.limits.upper), [167, 90, 101, 180, 113, 360], rtol=1e-15)
    np.testing.assert_allclose(np.rad2deg(er3a.limits.velocity), [230, 230, 250, 320, 320, 420], rtol=1e-15)
    np.testing.assert_array_equal(er3a.limits.torque, [120, 150, 70, 25, 20, 12])
    np.testing.assert_allclose(er3a.rotor_inertia, [0.3, 0.3, 0.17, 0.032, 0.032, 0.0125], rtol=1e-14)
    np.testing.assert_array_equal(er3a.friction[:, 0], [8, 9, 5, 2, 2, 1])
    np.testing.assert_array_equal(er3a.friction[:, 1], [6, 6.5, 4, 1.2, 1.2, 0.5])
    assert np.isnan(er3a.torque_constant).all()
    assert (er3a.period, er3a.payload, er3a.ambient) == (0.004, 3.0, (0.0, 45.0))


def test_every_value_of_the_er3a_says_where_it_comes_from(er3a):
    """Each entry of the ER3A's file has a source, and the assumed ones are those without any."""
    text = yaml.safe_load((CATALOG / "er3a.yaml").read_text())
    dynamics = text["dynamics"]
    entries = [*text["geometry"]["joints"], *text["limits"].values(), *dynamics["links"]]
    entries += [*dynamics["drives"].values(), *dynamics["friction"].values(), text["payload"], text["mass"]]
    assert all(entry["source"] in ("thesis", "public", "derived", "assumed") for entry in entries)
    assert er3a.assumed == (
        "limits.acceleration",
        "limits.jerk",
        "limits.torque",
        "dynamics.links",
        "dynamics.drives.gear_ratio",
        "dynamics.drives.rotor_inertia",
        "dynamics.friction.coulomb",
        "dynamics.friction.viscous",
    )


def test_the_panda_is_its_seven_joints():
    """The Panda of the catalogue moves its seven joints, carries its hand, and ends at the hand's tool point."""
    panda = load_robot("panda")
    assert panda.joint_names == tuple(f"panda_joint{i}" for i in range(1, 8))
    # link 7, hand and two fingers
    assert panda.inertia[6, 0] == pytest.approx(0.735522 + 0.73 + 2 * 0.015, abs=1e-12)
    # 88 mm out; 333 + 316 + 384 mm up and 107 + 103.4 mm down again
    np.testing.assert_allclose(panda.chain.flange(np.zeros(7))[:3, 3], [0.088, 0, 1.033 - 0.2104], atol=1e-12)
    assert panda.assumed == ()


def test_the_ur10_ends_at_its_tool_frame():
    """The UR10 of the catalogue has six joints and ends at tool0."""
    ur10 = load_robot("ur10")
    assert ur10.n == 6
    assert ur10.assumed == ("limits.acceleration", "limits.jerk")
    # 612 + 572.3 mm out at zero, the arm stretched along x (the URDF's right angles are given to 1e-11)
    np.testing.assert_allclose(ur10.chain.flange(np.zeros(6))[0, 3], 0.612 + 0.5723, atol=1e-9)


def test_digests_are_of_the_files():
    """A robot of one file has that file's digest."""
    assert load_robot("er3a").digest == hashlib.sha256((CATALOG / "er3a.yaml").read_bytes()).hexdigest()
