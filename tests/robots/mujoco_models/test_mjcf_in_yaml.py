"""A robot YAML that names an MJCF: the model's bodies and drives, with limits that an MJCF cannot state."""

import mujoco
import numpy as np
import pytest

from robots import load_robot
from robots.common.errors import InputError
from robots.regressor import default_model
from tests.robots.mujoco_models.arms import ARM, inverse_dynamics, states

YAML = """
name: my_arm
mjcf: model.xml
tip: tool
limits:
  velocity: {values: [2, 2.5, 3], unit: rad/s}
  torque: {values: [70, 60, 10], unit: N m}
period: 0.002
"""


@pytest.fixture
def file(tmp_path):
    """A model, and the YAML beside it."""
    (tmp_path / "model.xml").write_text(ARM)
    path = tmp_path / "my_arm.yaml"
    path.write_text(YAML)
    return path


def test_bodies_and_drives_are_those_of_the_model(file):
    """Torques, friction and armature in, are those of MuJoCo; the limits are those of the YAML."""
    robot = load_robot(file)
    q, dq, ddq = states(robot.n)
    model = default_model(robot, friction="polynomial")
    compiled = mujoco.MjModel.from_xml_path(str(file.parent / "model.xml"))
    expected = inverse_dynamics(compiled, robot.joint_names, q, dq, ddq, solver_friction=False)
    error = np.abs(model.torque(q, dq, ddq, model.nominal) - expected).max(axis=0)
    assert (error < 1e-9 * np.abs(expected).max(axis=0)).all()
    np.testing.assert_array_equal(robot.limits.velocity, [2, 2.5, 3])
    np.testing.assert_array_equal(robot.limits.torque, [70, 60, 10])
    np.testing.assert_allclose(np.rad2deg(robot.limits.upper), [170, 120, 180])
    assert robot.period == 0.002
    assert not any("velocity" in note for note in robot.notes)
    # A quarter of a second to full speed, and a twentieth to full acceleration.
    (assumed,) = (note for note in robot.notes if "assumed" in note)
    assert "acceleration limits 8, 10, 12 rad/s2" in assumed
    assert "jerk limits 160, 200, 240 rad/s3" in assumed


def test_drives_of_the_yaml_replace_those_of_the_model(file):
    """A stated rotor counts at the joint, by the square of the gear; a joint may be locked."""
    drives = "dynamics: {drives: {gear_ratio: {values: 100}, rotor_inertia: {values: 2.0e-5}}}\n"
    file.write_text(YAML + drives)
    np.testing.assert_allclose(load_robot(file).rotor_inertia, 0.2)
    two = load_robot(file, locked={"elbow": 0.3})
    assert two.joint_names == ("shoulder", "turn")
    np.testing.assert_array_equal(two.limits.velocity, [2, 3])


def test_the_models_file_is_kept_on_export(file):
    """The MJCF that is written from such a robot is the model's own, comments included."""
    from estimation.exports.mjcf import build_mjcf
    from estimation.models.model import Model
    from robots.base_parameters import find_base_parameters

    robot = load_robot(file)
    base = find_base_parameters(default_model(robot, friction="coulomb-viscous"))
    values = base.from_standard(base.model.nominal)
    model = Model(
        torque_model=base.model,
        columns=base.independent,
        values=values,
        covariance=np.zeros((len(values), len(values))),
        determined=np.ones(len(values), dtype=bool),
        formulas=base.formulas(),
        provenance={},
    )
    assert "<!-- the arm -->" in build_mjcf(model, robot).text


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (("mjcf: model.xml", "mjcf: model.xml\nurdf: arm.urdf"), "one of 'geometry', 'urdf' and 'mjcf'"),
        (("mjcf: model.xml", "mjcf: nowhere.xml"), "nowhere.xml"),
        (("[2, 2.5, 3]", "[2, 2.5]"), "limits.velocity"),
    ],
)
def test_wrong_files(file, change, text):
    """Two sources, a file that is not there, and another number of values are named."""
    file.write_text(YAML.replace(*change))
    with pytest.raises(InputError, match=text):
        load_robot(file)
