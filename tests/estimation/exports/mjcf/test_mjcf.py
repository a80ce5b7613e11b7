from dataclasses import replace
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest

from estimation.exports.mjcf import build_mjcf, export_mjcf
from estimation.models.extension import Extension
from estimation.models.model import Model
from robots import load_robot
from robots.base_parameters import find_base_parameters
from robots.common.errors import InputError
from robots.regressor import TorqueModel, default_model
from tests.robots.mujoco_models.arms import ARM, GANTRY, inverse_dynamics, states

pytestmark = pytest.mark.slow

# Two recursions in double precision, and the solver's principal axes.
PARITY = 1e-9


def made(robot, *, spread=0.1, offset=0.0, extensions=(), seed=1):
    """A model of the robot whose parameters are off its description; links are its first columns."""
    model = default_model(robot, friction="coulomb-viscous")
    rng = np.random.default_rng(seed)
    # One factor for each link, so that its body stays one that can exist.
    links = np.repeat(rng.uniform(-1.0, 1.0, robot.n), 10)
    factors = np.concatenate([links, rng.uniform(-1.0, 1.0, model.size - len(links))])
    standard = np.asarray(model.nominal) * (1.0 + spread * factors)
    standard[[i for i, column in enumerate(model.columns) if column.term == "torque_offset"]] = offset
    base = find_base_parameters(model)
    values = base.from_standard(standard)
    return Model(
        torque_model=model,
        columns=base.independent,
        values=values,
        covariance=np.eye(len(values)),
        determined=np.ones(len(values), dtype=bool),
        formulas=base.formulas(),
        extensions=tuple(extensions),
    )


def effect(name, joint, shape, coefficients):
    size = len(shape) + len(coefficients)
    return Extension(
        effect=name,
        joint=joint,
        shape=shape,
        coefficients=np.array(coefficients, dtype=float),
        covariance=np.zeros((size, size)),
    )


def file_of(tmp_path, text, **choice):
    path = tmp_path / "original.xml"
    path.write_text(text)
    return load_robot(path, **choice)


def agrees(path, model, robot, *, at=None, solver_friction=True):
    q, dq, ddq = states(robot.n)
    compiled = mujoco.MjModel.from_xml_path(str(path))
    found = inverse_dynamics(compiled, robot.joint_names, q, dq, ddq, solver_friction=solver_friction)
    expected = model.torque(q, dq, ddq, t=None if at is None else at + 0.004 * np.arange(len(q)))
    assert (np.abs(found - expected).max(axis=0) < PARITY * np.abs(expected).max(axis=0)).all()


@pytest.mark.parametrize(("text", "choice"), [(ARM, {"tip": "tool"}), (GANTRY, {})], ids=["arm", "gantry"])
def test_mujocos_torques_of_the_written_file_are_the_models(tmp_path, text, choice):
    """MuJoCo's inverse dynamics, its solver's dry friction in, are the identified model's torques."""
    robot = file_of(tmp_path, text, **choice)
    model = made(robot)
    written = export_mjcf(model, tmp_path / "corrected.xml", robot=robot)
    assert not written.remarks
    agrees(tmp_path / "corrected.xml", model, robot)


def test_a_catalogue_robot_becomes_a_plain_chain(tmp_path):
    """A robot from elsewhere gets a new file with the identified torques, its limits and motors."""
    robot = load_robot("ur10")
    model = made(robot)
    export_mjcf(model, tmp_path / "ur10.xml", robot=robot)
    # The description states no friction, so that the identified one is zero.
    agrees(tmp_path / "ur10.xml", model, robot)
    again = load_robot(tmp_path / "ur10.xml")
    assert again.joint_names == robot.joint_names
    np.testing.assert_allclose(again.limits.torque, robot.limits.torque)
    np.testing.assert_allclose(again.chain.flange(np.ones(6)), robot.chain.flange(np.ones(6)), atol=1e-12)


def test_everything_else_of_the_file_stays(tmp_path):
    """Comments, defaults, shapes, actuators, sites and the finger stay; only known attributes change."""
    robot = file_of(tmp_path, ARM, tip="tool")
    text = build_mjcf(made(robot), robot).text
    assert "<!-- the arm -->" in text
    before, after = ElementTree.fromstring(ARM), ElementTree.fromstring(text)
    changed = {"armature", "damping", "frictionloss", "solreffriction"}
    for tag in ("geom", "site", "motor", "position", "default", "option", "compiler", "body"):
        assert [e.attrib for e in before.iter(tag)] == [e.attrib for e in after.iter(tag)]
    for old, new in zip(before.find("worldbody").iter("joint"), after.find("worldbody").iter("joint"), strict=True):
        assert {k: v for k, v in old.attrib.items() if k not in changed} == {
            k: v for k, v in new.attrib.items() if k not in changed
        }
    finger = next(joint for joint in after.iter("joint") if joint.get("name") == "grip")
    assert not changed & set(finger.attrib)


@pytest.mark.parametrize(
    ("angle", "power", "preload"), [("degree", 3.0, 0.0), ("radian", 3.0, -2.0), ("radian", 1.0, -2.0)]
)
def test_a_spring_takes_up_its_joints_offset(tmp_path, angle, power, preload):
    """Stiffness and springref state a straight spring, its preload and the constant torque exactly."""
    text = GANTRY.replace('angle="radian"', f'angle="{angle}"')
    robot = file_of(tmp_path, text)
    model = made(robot, offset=1.5, extensions=[effect("spring", 2, (0.0, 0.0, power), [25.0, 0.0, 0.0, preload])])
    written = export_mjcf(model, tmp_path / "corrected.xml", robot=robot)
    assert "spring of joint swing" in written.stated
    # The rail has no spring, and its offset has no place.
    assert [remark for remark in written.remarks if "torque offsets" in remark and "rail" in remark]
    rail = replace(model, values=np.where([name == "offset_1" for name in model.names], 0.0, model.values))
    assert (rail.values != model.values).any()
    agrees(tmp_path / "corrected.xml", rail, robot, at=0.0)


def test_a_curved_spring_is_stated_nearly(tmp_path):
    """The straight line for a curved spring is named with its largest difference."""
    robot = file_of(tmp_path, GANTRY)
    model = made(robot, extensions=[effect("spring", 2, (0.0, 0.0, 3.0), [25.0, 0.0, 6.0, 0.0])])
    recorded = {"position": [[-0.5, -1.0], [0.5, 1.0]], "velocity": [[1.0, 2.0]]}
    written = build_mjcf(replace(model, provenance={**model.provenance, "recorded": recorded}), robot)
    swing = next(j for j in ElementTree.fromstring(written.text).iter("joint") if j.get("name") == "swing")
    q = np.linspace(-1.0, 1.0, 50)
    slope = np.polyfit(q, 25 * q + 6 * q**3, 1)[0]
    assert float(swing.get("stiffness")) == pytest.approx(slope)
    largest = np.abs(slope * q - 25 * q - 6 * q**3).max()
    assert f"{largest:.2g} N m" in next(remark for remark in written.remarks if "spring" in remark)


def test_a_payload_hangs_on_the_flange(tmp_path):
    """A payload picked up during the log becomes a body; torques after the pick-up agree."""
    robot = file_of(tmp_path, ARM, tip="tool")
    body = [1.2, 0.12, 0.0, 0.06, 0.02, 0.001, -0.008, 0.03, 0.0, 0.025]
    model = made(robot, extensions=[effect("payload_change", None, (5.0, 1.0, 0.0), body)])
    written = export_mjcf(model, tmp_path / "corrected.xml", robot=robot)
    assert "payload" in written.stated
    assert any("t = 5.00 s" in remark for remark in written.remarks)
    agrees(tmp_path / "corrected.xml", model, robot, at=6.0)


def test_a_coupling_becomes_a_tendon(tmp_path):
    """Coupled inertia, damping and dry friction act through tendons as in the model."""
    robot = file_of(tmp_path, ARM, tip="tool")
    model = made(robot, extensions=[effect("joint_coupling", 3, (-1.0,), [0.008, -0.1, -0.1, 0.3])])
    written = export_mjcf(model, tmp_path / "corrected.xml", robot=robot)
    assert "coupling of joints 2 and 3" in written.stated
    q, dq, ddq = states(3)
    # The dry friction of the pair fades where its joint velocity does.
    clear = np.abs(dq[:, 1] - dq[:, 2]) > 0.3
    compiled = mujoco.MjModel.from_xml_path(str(tmp_path / "corrected.xml"))
    compiled.tendon_solref_fri[:] = [0.001, 1.0]
    found = inverse_dynamics(compiled, robot.joint_names, q, dq, ddq, solver_friction=True)
    expected = model.torque(q, dq, ddq, t=0.004 * np.arange(len(q)))
    assert np.abs(found - expected)[clear].max() < PARITY * np.abs(expected).max()


def test_what_mjcf_cannot_state_is_said_and_is_in_the_file(tmp_path):
    """Other effects, and a spring of the file that the model lacks, are named in the comment and in the remarks."""
    robot = file_of(tmp_path, GANTRY.replace('name="swing"', 'name="swing" stiffness="7"'))
    written = build_mjcf(made(robot, extensions=[effect("time_delay", None, (0.01,), [])]), robot)
    words = " ".join(written.remarks)
    assert "time delay" in words
    assert "spring of joint swing (7) was removed" in words
    assert "time delay" in written.text
    assert 'stiffness="0.0"' in written.text


def test_inertia_from_geoms_and_default_classes_give_way(tmp_path):
    """A compiler that takes all inertia from geoms, and damping of a default class, do not hide the numbers."""
    robot = file_of(
        tmp_path,
        ARM.replace('angle="degree"', 'angle="degree" inertiafromgeom="true" settotalmass="9"').replace(
            '<inertial pos="0.02 0.01 0.15" mass="4" fullinertia="0.06 0.055 0.02 0.001 -0.002 0.003"/>',
            '<geom type="box" size="0.04 0.05 0.15" pos="0 0 0.15"/>',
        ),
        tip="tool",
    )
    model = made(robot)
    export_mjcf(model, tmp_path / "corrected.xml", robot=robot)
    agrees(tmp_path / "corrected.xml", model, robot)


def test_meshes_are_found_from_another_folder(tmp_path):
    """The written file loads from another folder: the folder of its meshes is stated as seen from there."""
    corners = [(0, 0, 0), (0.1, 0, 0), (0, 0.1, 0), (0, 0, 0.1)]
    faces = [(1, 3, 2), (1, 2, 4), (2, 3, 4), (3, 1, 4)]
    (tmp_path / "meshes").mkdir()
    lines = [f"v {x} {y} {z}" for x, y, z in corners] + [f"f {a} {b} {c}" for a, b, c in faces]
    (tmp_path / "meshes" / "hand.obj").write_text("\n".join(lines))
    text = GANTRY.replace('angle="radian"', 'angle="radian" meshdir="meshes"')
    text = text.replace("<worldbody>", '<asset><mesh name="hand" file="hand.obj"/></asset><worldbody>')
    text = text.replace('<body name="arm"', '<geom type="mesh" mesh="hand"/><body name="arm"')
    robot = file_of(tmp_path, text)
    other = tmp_path / "results" / "here"
    other.mkdir(parents=True)
    model = made(robot)
    export_mjcf(model, other / "corrected.xml", robot=robot)
    agrees(other / "corrected.xml", model, robot)
    assert [path.name for path in other.iterdir()] == ["corrected.xml"]


def test_an_existing_file_is_refused(tmp_path):
    """An existing file is kept without force."""
    robot = file_of(tmp_path, GANTRY)
    model = made(robot)
    with pytest.raises(InputError, match="exists"):
        export_mjcf(model, tmp_path / "original.xml", robot=robot)


def test_a_link_lighter_than_what_is_locked_on_it(tmp_path):
    """Bodies on locked joints lose mass where the identified link is too light for them, and the file says so."""
    # The hand and its finger together get half their mass, less than the finger has.
    arm = file_of(tmp_path, ARM.replace('size="0.01 0.01 0.03"', 'size="0.1 0.1 0.1"'), tip="tool")
    light = made(arm, spread=0.0)
    standard = np.asarray(light.torque_model.nominal).copy()
    standard[20:30] *= 0.5
    light = replace(light, values=find_base_parameters(light.torque_model).from_standard(standard))
    written = export_mjcf(light, tmp_path / "light.xml", robot=arm)
    assert any(remark.startswith("finger: mass times 0.1") for remark in written.remarks)
    agrees(tmp_path / "light.xml", light, arm)


def test_parameters_that_no_body_has_become_the_nearest_ones(tmp_path):
    """Noise that makes a wrist's inertia negative moves parameters by some standard errors, and the file says so."""
    robot = file_of(tmp_path, ARM, tip="tool")
    model = made(robot)
    base = find_base_parameters(model.torque_model)
    name = next(i for i, formula in enumerate(model.formulas) if formula.startswith("Ixx_3"))
    errors = np.full(len(model.values), 1e-3)
    errors[name] = 0.02
    values = model.values.copy()
    values[name] = -0.02
    noisy = replace(model, values=values, covariance=np.diag(errors**2))
    written = export_mjcf(noisy, tmp_path / "corrected.xml", robot=robot)
    said = next(remark for remark in written.remarks if "standard errors" in remark)
    again = load_robot(tmp_path / "corrected.xml", tip="tool")
    nominal = default_model(again, friction="coulomb-viscous")
    found = base.from_standard(nominal.nominal)
    moved = np.abs(found - values) / errors
    assert moved[name] > 1.0
    assert moved.max() < 3.0
    assert f"{moved.max():.2g} standard errors" in said


def test_the_models_torque_model_stays_what_it_is(tmp_path):
    """Reading the written file back gives the identified parameters."""
    robot = file_of(tmp_path, GANTRY)
    model = made(robot)
    export_mjcf(model, tmp_path / "corrected.xml", robot=robot)
    again = load_robot(tmp_path / "corrected.xml")
    nominal = default_model(again, friction="coulomb-viscous")
    base = find_base_parameters(TorqueModel(again, nominal.terms))
    np.testing.assert_allclose(base.from_standard(nominal.nominal), model.values, rtol=1e-9, atol=1e-9)
