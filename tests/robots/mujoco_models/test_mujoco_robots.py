from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest

import robots.loading
from robots import load_robot
from robots.regressor import default_model
from tests.robots.mujoco_models.arms import ARM, GANTRY, inverse_dynamics, states

# Two recursions in double precision.
PARITY = 1e-9


def converted(name):
    """MuJoCo's MJCF of a URDF of the catalogue, with drives; fixed links are kept."""
    urdf = ElementTree.parse(Path(robots.loading.CATALOG) / f"{name}.urdf").getroot()
    for link in urdf.findall("link"):
        for element in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(element)
    ElementTree.SubElement(ElementTree.SubElement(urdf, "mujoco"), "compiler", fusestatic="false")
    spec = mujoco.MjSpec.from_string(ElementTree.tostring(urdf, encoding="unicode"))
    spec.compile()
    root = ElementTree.fromstring(spec.to_xml())
    hinges = (joint for world in root.findall("worldbody") for joint in world.iter("joint"))
    for i, joint in enumerate(hinges, start=1):
        joint.set("armature", repr(0.1 * i))
        joint.set("damping", repr(2.0 / i))
        joint.set("frictionloss", repr(3.0 / i))
    return ElementTree.tostring(root, encoding="unicode")


@pytest.mark.parametrize(
    ("text", "choice"),
    [
        (ARM, {"tip": "tool"}),
        (ARM, {"tip": "finger"}),
        (GANTRY, {}),
        (lambda: converted("ur10"), {}),
        (lambda: converted("panda"), {"tip": "panda_hand"}),
    ],
    ids=["arm", "arm with finger", "gantry", "ur10", "panda"],
)
def test_torques_agree_with_mujocos_inverse_dynamics(tmp_path, text, choice):
    """Torques of the described robot, friction and armature in, are those of MuJoCo's inverse dynamics."""
    path = tmp_path / "model.xml"
    path.write_text(text() if callable(text) else text)
    robot = load_robot(path, **choice)
    q, dq, ddq = states(robot.n)
    model = default_model(robot, friction="polynomial")
    expected = inverse_dynamics(
        mujoco.MjModel.from_xml_path(str(path)), robot.joint_names, q, dq, ddq, solver_friction=False
    )
    assert (robot.friction[:, :2].sum(axis=1) > 0).all()
    error = np.abs(model.torque(q, dq, ddq, model.nominal) - expected).max(axis=0)
    assert (error < PARITY * np.abs(expected).max(axis=0)).all()


def test_flange_is_the_site_in_mujocos_kinematics(tmp_path):
    """The flange of the chosen site is where MuJoCo has it."""
    path = tmp_path / "arm.xml"
    path.write_text(ARM)
    robot = load_robot(path, tip="tool")
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    q = np.array([0.4, -0.7, 1.1])
    data.qpos[:3] = q
    mujoco.mj_kinematics(model, data)
    pose = robot.chain.flange(q)
    np.testing.assert_allclose(pose[:3, 3], data.site("tool").xpos, atol=1e-12)
    np.testing.assert_allclose(pose[:3, :3], data.site("tool").xmat.reshape(3, 3), atol=1e-12)


def test_limits_gravity_and_drives_are_read(tmp_path):
    """Ranges come in radians; torque limits from motors, force ranges and the joint's own range."""
    path = tmp_path / "arm.xml"
    path.write_text(ARM)
    robot = load_robot(path, tip="tool")
    assert robot.joint_names == ("shoulder", "elbow", "turn")
    np.testing.assert_allclose(robot.limits.upper, np.deg2rad([170, 120, 180]))
    np.testing.assert_array_equal(robot.limits.torque, [100.0, 80.0, np.inf])
    np.testing.assert_array_equal(robot.chain.gravity, [0.5, 0.0, -9.7])
    np.testing.assert_array_equal(robot.rotor_inertia, [0.05, 0.05, 0.02])
    np.testing.assert_array_equal(robot.friction[:, :2], [[1.5, 0.8], [1.2, 0.8], [0.4, 0.2]])
    gantry = tmp_path / "gantry.mjcf"
    gantry.write_text(GANTRY)
    other = load_robot(gantry)
    assert other.chain.kinds == ("prismatic", "revolute")
    np.testing.assert_array_equal(other.limits.lower, [-0.5, -np.inf])


def test_gravity_switched_off_is_none(tmp_path):
    """The flag that disables gravity counts."""
    path = tmp_path / "gantry.xml"
    path.write_text(GANTRY.replace('timestep="0.0005"/>', 'timestep="0.0005"><flag gravity="disable"/></option>'))
    np.testing.assert_array_equal(load_robot(path).chain.gravity, np.zeros(3))


def test_files_that_are_included_count(tmp_path):
    """A robot in an included file is read, and the digest covers that file."""
    body = GANTRY.split("<worldbody>")[1].split("</worldbody>")[0]
    whole, part = tmp_path / "scene.xml", tmp_path / "parts" / "arm.xml"
    part.parent.mkdir()
    part.write_text(f"<mujocoinclude><worldbody>{body}</worldbody></mujocoinclude>")
    whole.write_text(GANTRY.replace(body, "").replace("<worldbody>", '<include file="parts/arm.xml"/><worldbody>'))
    plain = tmp_path / "plain.xml"
    plain.write_text(GANTRY)
    first = load_robot(whole)
    np.testing.assert_array_equal(first.inertia, load_robot(plain).inertia)
    part.write_text(part.read_text().replace('mass="8"', 'mass="9"'))
    assert load_robot(whole).digest != first.digest


def test_the_root_element_tells_an_mjcf(tmp_path):
    """A file of any ending is an MJCF if its root element is <mujoco>."""
    path = tmp_path / "gantry.txt"
    path.write_text(GANTRY)
    assert load_robot(path).n == 2


def test_what_is_not_read_is_named_in_one_note(tmp_path):
    """Springs, tendons, equality constraints, contacts, gravity compensation and loose objects are named."""
    text = GANTRY.replace("<worldbody>", '<worldbody><body name="box"><freejoint/><geom size="0.1"/></body>')
    text = text.replace('name="swing"', 'name="swing" stiffness="5"').replace('name="arm"', 'name="arm" gravcomp="1"')
    text = text.replace(
        "</mujoco>",
        '<tendon><fixed name="t"><joint joint="swing" coef="1"/></fixed></tendon>'
        '<equality><weld body1="box"/></equality></mujoco>',
    )
    path = tmp_path / "gantry.xml"
    path.write_text(text)
    notes = [note for note in load_robot(path).notes if note.startswith("not used from the MJCF")]
    assert len(notes) == 1
    for words in ("spring of joint swing", "1 tendon", "1 equality constraint", "contacts", "body on a free joint box"):
        assert words in notes[0]
    assert "gravity compensation of body arm" in notes[0]


def test_a_finger_that_follows_another_one_is_locked(tmp_path):
    """A joint under a linear equality constraint is locked where its leader is locked."""
    follower = '<joint name="grip2" type="slide" axis="0 -1 0"/>'
    finger = f'<body name="finger2" pos="0.1 -0.02 0">{follower}<geom type="box" size="0.01 0.01 0.03"/></body>'
    text = ARM.replace('<body name="finger" pos', f'{finger}<body name="finger" pos')
    text = text.replace(
        "</mujoco>", '<equality><joint joint1="grip2" joint2="grip" polycoef="0 2 0 0 0"/></equality></mujoco>'
    )
    path = tmp_path / "arm.xml"
    path.write_text(text)
    robot = load_robot(path, tip="tool", locked={"grip": 0.03})
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    names = [model.joint(j).name for j in range(model.njnt)]
    # grip starts at .01, grip2 at 0: q2 = 2 (q - .01).
    data.qpos[:] = [0.0 if name not in ("grip", "grip2") else {"grip": 0.03, "grip2": 0.04}[name] for name in names]
    mujoco.mj_kinematics(model, data)
    at = {place.name: place.pose for place in robot.links}
    pose = robot.chain.transforms(np.zeros(3))[-1] @ at["finger2"]
    np.testing.assert_allclose(pose[:3, 3], data.body("finger2").xpos, atol=1e-12)
