from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from estimation import identify, load_model
from estimation.exports import export_urdf, standard_parameters
from estimation.exports.unstated import unstated_terms
from robots import load_robot, nominal_plant, simulate
from robots.base_parameters import find_base_parameters
from robots.common.errors import InfeasibleError, InputError, NearestBodiesWarning
from robots.consistency import normalised_eigenvalues
from robots.regressor import TorqueModel
from robots.terms import PositionTorque, RigidBody

pytestmark = pytest.mark.slow

# Rigid torques of two recursions over six bodies, of order 100 N m: rounding, relative to the largest.
PARITY = 1e-9


@pytest.fixture(scope="module")
def ur10(fourier_motion):
    """A UR10 whose links are 10 % off its description: identified by a consistent fit, and as it truly is."""
    robot = load_robot("ur10")
    plant = nominal_plant(robot, spread=0.1, seed=1)
    log = simulate(plant, fourier_motion(robot, duration=30.0), seed=0)
    base = find_base_parameters(plant.model)
    return robot, identify(robot, log, method="consistent").model, _model(base, base.from_standard(plant.parameters))


def states(n, count=40):
    return np.random.default_rng(0).uniform(-2, 2, (3, count, n))


def rigid_torque(model, q, dq, ddq):
    values = np.where([column.term == "rigid_body" for column in model.parameters], model.values, 0.0)
    return model.torque_model.torque(q, dq, ddq, values, columns=model.columns)


def pinocchio_torque(path, q, dq, ddq):
    model = pin.buildModelFromUrdf(str(path))
    data = model.createData()
    return np.array([pin.rnea(model, data, *row) for row in zip(q, dq, ddq, strict=True)])


def test_an_urdf_reloads_and_gives_the_same_torques(ur10, tmp_path):
    """pinocchio, and our own reader, get the identified model's rigid-body torques from the written file."""
    robot, *models = ur10
    q, dq, ddq = states(6)
    for model in models:
        path = tmp_path / "identified.urdf"
        export_urdf(model, path, robot=robot, force=True)
        # A consistent fit states bodies and rotors apart; base parameters leave a rotor with the link it turns.
        expected = rigid_torque(model, q, dq, ddq)
        if "standard_parameters" in model.provenance:
            rigid = TorqueModel(robot, (RigidBody(),))
            expected = rigid.torque(q, dq, ddq, standard_parameters(model).reshape(-1))
        scale = np.abs(expected).max()
        assert np.abs(pinocchio_torque(path, q, dq, ddq) - expected).max() < PARITY * scale
        again = load_robot(path)
        torque = TorqueModel(again, (RigidBody(),)).torque(q, dq, ddq, again.inertia.reshape(-1))
        assert np.abs(torque - expected).max() < PARITY * scale
        np.testing.assert_allclose(again.limits.velocity, robot.limits.velocity)


def test_bodies_and_the_other_terms_make_the_models_torque(ur10):
    """The bodies of a consistent fit, with its rotors, friction and offsets, give the identified model's torque."""
    model = ur10[1]
    q, dq, ddq = states(6)
    chosen = np.array(model.provenance["standard_parameters"])
    expected = model.torque(q, dq, ddq)
    np.testing.assert_allclose(
        model.torque_model.torque(q, dq, ddq, chosen), expected, atol=1e-9 * np.abs(expected).max()
    )


def test_the_bodies_can_exist_and_stay_near_the_description(ur10):
    """Every pseudo-inertia is positive definite, and masses stay within a link's own size of the described ones."""
    robot, *models = ur10
    for model in models:
        standard = standard_parameters(model, robot.inertia)
        assert (normalised_eigenvalues(standard) > 0).all()
        assert (np.abs(standard[:, 0] - robot.inertia[:, 0]) < robot.inertia[:, 0]).all()


def test_a_described_robot_comes_back_as_it_is(ur10):
    """Base parameters of the description itself give the description."""
    robot = ur10[0]
    model = TorqueModel(robot, (RigidBody(),))
    base = find_base_parameters(model)
    found = standard_parameters(_model(base, base.from_standard(model.nominal)), robot.inertia)
    # The interior-point solver stops at some 1e-8 of the parameters' scale.
    np.testing.assert_allclose(found, robot.inertia, rtol=1e-4, atol=1e-4)


def test_bodies_that_cannot_exist_give_way_to_the_nearest(arm, tmp_path):
    """Inertias of the wrong sign by a hundred of their standard errors: a warning, and bodies that can exist."""
    model = TorqueModel(arm, (RigidBody(),))
    base = find_base_parameters(model)
    values = base.from_standard(model.nominal)
    wrong = _model(base, -0.2 * values)
    wrong = replace(wrong, covariance=np.diag((0.01 * values) ** 2 + 1e-12))
    with pytest.raises(InfeasibleError, match="consistent"):
        standard_parameters(wrong, arm.inertia)
    path = tmp_path / "robot.urdf"
    with pytest.warns(NearestBodiesWarning, match=r"differ by up to \d+ standard errors"):
        export_urdf(wrong, path, robot=arm)
    assert "nearest" in path.read_text()
    assert (normalised_eigenvalues(load_robot(path).inertia) > 0).all()


def test_a_robot_without_description_is_refused(arm):
    """Base parameters alone leave bodies open: without a description, or a consistent fit, there is no URDF."""
    bare = replace(arm, inertia=None)
    base = find_base_parameters(TorqueModel(bare, (RigidBody(),)))
    with pytest.raises(InputError, match="consistent"):
        standard_parameters(_model(base, np.ones(base.size)))


def test_a_consistent_fit_is_written_as_it_is(arm, arm_log, tmp_path):
    """The standard parameters that a consistent fit chose are those of the file, also from a saved model."""
    estimate = identify(arm, arm_log(), method="consistent")
    estimate.save(tmp_path)
    model = load_model(tmp_path)
    path = tmp_path / "arm.urdf"
    export_urdf(model, path, robot=arm)
    q, dq, ddq = states(2)
    rigid = standard_parameters(model)
    expected = TorqueModel(arm, (RigidBody(),)).torque(q, dq, ddq, rigid.reshape(-1))
    np.testing.assert_allclose(pinocchio_torque(path, q, dq, ddq), expected, atol=PARITY * np.abs(expected).max())


def test_the_robots_own_urdf_keeps_its_other_elements(tmp_path):
    """Of a robot from a URDF the file itself is updated: visuals stay, fixed links hand their inertia over."""
    source = tmp_path / "one.urdf"
    source.write_text(
        """<robot name="one"><link name="base"/><link name="a"><inertial><mass value="1"/><origin xyz="0 0 0.1"/>
        <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial><visual><geometry>
        <sphere radius="0.1"/></geometry></visual></link><link name="tool"><inertial><mass value="0.5"/>
        <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
        <joint name="j" type="revolute"><parent link="base"/><child link="a"/><axis xyz="0 1 0"/>
        <limit lower="-1" upper="1" velocity="1" effort="5"/></joint>
        <joint name="f" type="fixed"><parent link="a"/><child link="tool"/><origin xyz="0 0 0.3"/></joint></robot>"""
    )
    robot = load_robot(source)
    base = find_base_parameters(TorqueModel(robot, (RigidBody(),)))
    values = 1.2 * base.from_standard(base.model.nominal)
    path = tmp_path / "new.urdf"
    export_urdf(_model(base, values), path, robot=robot)
    text = path.read_text()
    assert "sphere" in text
    assert text.count("<inertial>") == 1
    q, dq, ddq = states(1)
    expected = base.torque(q, dq, ddq, values)
    np.testing.assert_allclose(pinocchio_torque(path, q, dq, ddq), expected, atol=PARITY * np.abs(expected).max())


def test_a_second_arm_keeps_its_bodies(tmp_path):
    """Links on joints that are not of the chain keep their inertia, and all together move as the identified link."""
    source = tmp_path / "two.urdf"
    body = """<inertial><origin xyz="0.02 0 0.1" rpy="0.1 0 0"/><mass value="{m}"/><inertia ixx="0.1" ixy="0" ixz="0"
        iyy="0.1" iyz="0" izz="0.08"/></inertial>"""
    joint = """<joint name="{name}" type="revolute"><parent link="{a}"/><child link="{b}"/><axis xyz="{axis}"/>
        <origin xyz="0 0.1 0.2" rpy="0.3 0 0"/><limit lower="-1" upper="1" velocity="1" effort="5"/></joint>"""
    masses = {"trunk": 5, "right": 2, "left": 1.5, "hand": 0.4}
    links = "".join(f'<link name="{name}">{body.format(m=m)}</link>' for name, m in masses.items())
    joints = [("turn", "base", "trunk", "0 0 1"), ("r", "trunk", "right", "0 1 0"), ("l", "trunk", "left", "0 1 0")]
    tree = "".join(joint.format(name=name, a=a, b=b, axis=axis) for name, a, b, axis in joints)
    hand = '<joint name="h" type="fixed"><parent link="left"/><child link="hand"/><origin xyz="0 0 0.3"/></joint>'
    source.write_text(f'<robot name="two"><link name="base"/>{links}{tree}{hand}</robot>')
    robot = load_robot(source, tip="right")
    base = find_base_parameters(TorqueModel(robot, (RigidBody(),)))
    values = 1.1 * base.from_standard(base.model.nominal)
    path = tmp_path / "new.urdf"
    export_urdf(_model(base, values), path, robot=robot)
    assert "left, hand keep their inertia" in path.read_text() or "hand, left keep" in path.read_text()
    whole = pin.buildModelFromUrdf(str(path))
    assert all(inertia.mass > 0 for inertia in whole.inertias[1:])
    held = pin.buildReducedModel(whole, [whole.getJointId("l")], pin.neutral(whole))
    data = held.createData()
    q, dq, ddq = states(2)
    found = np.array([pin.rnea(held, data, *row) for row in zip(q, dq, ddq, strict=True)])
    # pinocchio sorts joints by their names within a branch.
    order = [held.getJointId(name) - 1 for name in robot.joint_names]
    expected = base.torque(q[:, order], dq[:, order], ddq[:, order], values)
    np.testing.assert_allclose(found[:, order], expected, atol=PARITY * np.abs(expected).max())


def test_torques_by_position_are_named_with_their_size():
    """A file that cannot state them says how large they are, and what to do."""
    robot = load_robot("er3a")
    base = find_base_parameters(TorqueModel(robot, (RigidBody(), PositionTorque())))
    values = base.from_standard(base.model.nominal)
    values[[column.name == "sin1_2" for column in base.columns]] = 4.0
    recorded = {"position": [[-1.0] * 6, [1.0] * 6]}
    model = replace(_model(base, values), provenance={"recorded": recorded})
    (text,) = unstated_terms(model, {"rigid_body"})
    assert text.startswith("position torque parameters (up to 3.4 N m at joint 2; ")
    assert "--no-position" in text
    (plain,) = unstated_terms(replace(model, provenance={}), {"rigid_body"})
    assert plain == "position torque parameters"


def _model(base, values):
    from estimation import Model

    return Model(
        torque_model=base.model,
        columns=base.independent,
        values=values,
        covariance=np.eye(base.size),
        determined=np.ones(base.size, dtype=bool),
        formulas=base.formulas(),
    )


def test_limits_that_are_not_known_leave_a_readable_file(fourier_motion, tmp_path):
    """A URDF needs velocity and effort together: pinocchio and our reader take a file of a robot that states none."""
    known = load_robot("er3a")
    limits = replace(known.limits, torque=np.full(6, np.inf))
    tilted = replace(known.under(np.array([0.0, 9.81, 0.0])), limits=limits)
    plant = nominal_plant(tilted, seed=1)
    model = _model(find_base_parameters(plant.model), find_base_parameters(plant.model).from_standard(plant.parameters))
    export_urdf(model, tmp_path / "open.urdf", robot=tilted)
    assert pin.buildModelFromUrdf(str(tmp_path / "open.urdf")).nq == 6
    assert load_robot(tmp_path / "open.urdf").n == 6
    comment = (tmp_path / "open.urdf").read_text()
    assert "limits of velocity and effort that are not known are 1e+09" in comment
    assert "gravity along (0, 9.81, 0) m/s2 in the base frame" in comment
