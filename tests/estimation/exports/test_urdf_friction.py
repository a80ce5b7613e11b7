"""A written URDF states the friction of the model, and what it cannot state."""

from __future__ import annotations

import warnings
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from estimation.exports.friction import linear_friction
from estimation.exports.urdf import export_urdf
from estimation.models.model import Model
from robots.base_parameters import find_base_parameters
from robots.loading import load_robot
from robots.regressor import TorqueModel
from robots.terms import RigidBody
from robots.terms.friction import FrictionPolynomial
from robots.terms.rotor_inertia import RotorInertia

BODY = (
    '<inertial><mass value="1"/><origin xyz="0.1 0 0"/>'
    '<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial>'
)
TEXT = f"""<robot name="two"><link name="base"/><link name="a">{BODY}</link><link name="b">{BODY}</link>
<joint name="j1" type="revolute"><parent link="base"/><child link="a"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" velocity="2" effort="5"/><dynamics damping="0.1" friction="0.2" D="7"/></joint>
<joint name="j2" type="prismatic"><parent link="a"/><child link="b"/><axis xyz="1 0 0"/>
<limit lower="-1" upper="1" velocity="0.5" effort="5"/></joint></robot>"""


@pytest.fixture
def source(tmp_path):
    """A URDF with the friction of another day."""
    path = tmp_path / "two.urdf"
    path.write_text(TEXT)
    return path


def model_of(robot, friction, *more):
    """The description's model with friction coefficients of every joint."""
    model = TorqueModel(robot, (RigidBody(), FrictionPolynomial(), *more))
    nominal = model.nominal.copy()
    for index, column in enumerate(model.columns):
        if column.friction:
            nominal[index] = friction[column.joint - 1][int(column.symbol[1]) - 1]
    base = find_base_parameters(model)
    return Model(
        torque_model=model,
        columns=base.independent,
        values=base.from_standard(nominal),
        covariance=np.eye(base.size),
        determined=np.ones(base.size, dtype=bool),
        formulas=base.formulas(),
    )


def written(path):
    """Damping and friction of each joint, and the comments of the file."""
    text = path.read_text()
    joints = ElementTree.fromstring(text).findall("joint")
    dynamics = [joint.find("dynamics") for joint in joints]
    return [(float(d.get("damping")), float(d.get("friction"))) for d in dynamics], text


def test_friction_of_two_coefficients_is_stated_exactly(source, tmp_path):
    """Coulomb and viscous friction replace the old values, with a new element where there was none."""
    robot = load_robot(source)
    model = model_of(robot, [[0.7, 1.5, 0, 0], [3.0, 20.0, 0, 0]])
    export_urdf(model, tmp_path / "new.urdf", robot=robot)
    found, text = written(tmp_path / "new.urdf")
    np.testing.assert_allclose(found, [(1.5, 0.7), (20.0, 3.0)], rtol=1e-9)
    assert 'D="7"' in text
    assert "approximate" not in text
    again = load_robot(tmp_path / "new.urdf")
    np.testing.assert_allclose(again.friction[:, :2], [[0.7, 1.5], [3.0, 20.0]], rtol=1e-9)


def test_a_curve_is_approximated_up_to_the_recorded_speed(source, tmp_path):
    """Higher powers are approximated up to the recorded speed, never by negative values; the file says how well."""
    robot = load_robot(source)
    model = model_of(robot, [[1.0, 2.0, -0.4, 0.0], [1.0, -0.5, 0.0, 0.0]])
    model = replace(model, provenance={"recorded": {"velocity": [[1.5, 0.5]]}})
    fitted = linear_friction(model)
    speeds = np.linspace(0.03, 1.5, 50)
    curve = 1.0 + 2.0 * speeds - 0.4 * speeds**2
    slope, constant = np.polyfit(speeds, curve, 1)
    np.testing.assert_allclose([fitted.viscous[0], fitted.coulomb[0]], [slope, constant], rtol=1e-6)
    assert fitted.error[0] == pytest.approx(np.abs(constant + slope * speeds - curve).max(), rel=1e-6)
    assert fitted.viscous[1] == 0.0
    export_urdf(model, tmp_path / "new.urdf", robot=robot)
    found, text = written(tmp_path / "new.urdf")
    np.testing.assert_allclose(found[0], (slope, constant), rtol=1e-6)
    assert f"recorded speed: {fitted.error[0]:.2g} N m at joint j1, {fitted.error[1]:.2g} N at joint j2" in text


def test_what_a_urdf_cannot_state_is_named(source, tmp_path):
    """A comment of the file names rotor inertias; a file from the chain alone states friction, too."""
    robot = replace(load_robot(source), rotor_inertia=np.array([0.1, 2.0]), origin="")
    model = model_of(robot, [[0.7, 1.5, 0, 0], [3.0, 20.0, 0, 0]], RotorInertia())
    export_urdf(model, tmp_path / "new.urdf", robot=robot)
    found, text = written(tmp_path / "new.urdf")
    np.testing.assert_allclose(found, [(1.5, 0.7), (20.0, 3.0)], rtol=1e-9)
    assert "not stated, because a URDF cannot: rotor inertia parameters" in text


def test_a_model_without_friction_keeps_that_of_the_file(source, tmp_path):
    """Where no friction was identified, the old values stay."""
    robot = load_robot(source)
    base = find_base_parameters(TorqueModel(robot, (RigidBody(),)))
    model = Model(
        torque_model=base.model,
        columns=base.independent,
        values=base.from_standard(base.model.nominal),
        covariance=np.eye(base.size),
        determined=np.ones(base.size, dtype=bool),
        formulas=base.formulas(),
    )
    assert linear_friction(model) is None
    export_urdf(model, tmp_path / "new.urdf", robot=robot)
    text = (tmp_path / "new.urdf").read_text()
    assert 'damping="0.1" friction="0.2"' in text
    assert "damping and friction" not in text


def test_a_xacro_is_written_as_urdf(tmp_path):
    """The URDF of a robot from a xacro file is that of the expanded file."""
    pytest.importorskip("xacro")
    source = tmp_path / "two.urdf.xacro"
    space = '<robot name="two" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:arg name="v" default="2"/>'
    source.write_text(TEXT.replace('<robot name="two">', space).replace('velocity="2"', 'velocity="$(arg v)"'))
    robot = load_robot(f"{source} v:=3")
    export_urdf(model_of(robot, [[0.7, 1.5, 0, 0], [3.0, 20.0, 0, 0]]), tmp_path / "new.urdf", robot=robot)
    with warnings.catch_warnings(record=True):
        again = load_robot(tmp_path / "new.urdf")
    np.testing.assert_array_equal(again.limits.velocity, [3.0, 0.5])
    np.testing.assert_allclose(again.friction[:, 1], [1.5, 20.0], rtol=1e-9)
