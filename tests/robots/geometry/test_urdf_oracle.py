"""Chains from URDF files, against pinocchio."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from robots.geometry.urdf import read_urdf

ROOT = Path(__file__).parents[3]
DATA = ROOT.parent / "shared" / "data"
TIAGO = ["torso_lift_joint", *(f"arm_{i}_joint" for i in range(1, 8))]
PANDA = [f"panda_joint{i}" for i in range(1, 8)]
RECORDED = {
    "double_pendulum_dfki/dp_design_A.0_model_2.1_pendubot.urdf": {},
    "kuka_lwr4_flobaroid/kuka_lwr4.urdf": {},
    "panda_gaz2019/panda.urdf": {"joints": PANDA, "locked": {"panda_finger_joint1": 0.02, "panda_finger_joint2": 0.03}},
    "simple_pendulum_dfki/simple_pendulum.urdf": {},
    "tiago_figaroh/tiago_48_schunk.urdf": {"joints": TIAGO},
    "ur10_unisa/ur10_robot.urdf": {"tip": "tool0"},
}
PACKAGED = {
    "ur_description/urdf/ur10_robot.urdf": {"tip": "tool0"},
    "ur_description/urdf/ur3_gripper.urdf": {},
    "panda_description/urdf/panda.urdf": {"tip": "panda_link8"},
    "tiago_description/robots/tiago.urdf": {"joints": TIAGO, "locked": {"head_1_joint": 0.3}},
    "talos_data/robots/talos_left_arm.urdf": {},
    "kinova_description/robots/kinova.urdf": {},
    "baxter_description/urdf/baxter.urdf": {"tip": "left_hand_link"},
}


def agree(path, oracle, seed=0, **choice):
    """Compare kinematics to 1e-12 and inertial parameters to 1e-10 of the largest of their kind."""
    taken = read_urdf(path).chain(**choice)
    expected = oracle(path, taken.names, choice.get("locked"))
    lower = np.maximum(taken.limits.lower, -3.0)
    upper = np.minimum(taken.limits.upper, 3.0)
    for q in np.random.default_rng(seed).uniform(lower, upper, size=(5, len(lower))):
        np.testing.assert_allclose(taken.chain.transforms(q), expected.transforms(q), rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(taken.inertia, expected.inertia(), rtol=0.0, atol=1e-10 * max(1.0, taken.inertia.max()))
    np.testing.assert_allclose(taken.inertia, expected.inertia(), rtol=1e-10, atol=1e-10)


def packaged_robots():
    spec = find_spec("pinocchio")
    if spec is None or spec.origin is None:
        return None
    for parent in Path(spec.origin).parents:
        robots = parent / "share" / "example-robot-data" / "robots"
        if robots.is_dir():
            return robots
    return None


@pytest.mark.parametrize("file", RECORDED)
def test_urdfs_of_recorded_data(file, oracle, tmp_path):
    """URDFs that come with recorded data give pinocchio's kinematics and lumped inertia."""
    if not (DATA / file).exists():
        pytest.skip(f"the recorded data are not beside the repository: {file}")
    text = (DATA / file).read_text()
    if '"world"' in text and '<link name="world"' not in text:
        # We accept a world that is not declared, pinocchio does not.
        declared = tmp_path / "declared.urdf"
        declared.write_text(text.replace("</robot>", '<link name="world"/></robot>'))
        undeclared, taken = read_urdf(DATA / file).chain(), read_urdf(declared).chain()
        np.testing.assert_array_equal(undeclared.inertia, taken.inertia)
        agree(declared, oracle)
    else:
        agree(DATA / file, oracle, **RECORDED[file])


@pytest.mark.parametrize("file", PACKAGED)
def test_urdfs_of_public_robots(file, oracle):
    """URDFs of public robots give pinocchio's kinematics and lumped inertia."""
    robots = packaged_robots()
    if robots is None:
        pytest.skip("the package example-robot-data is not installed")
    agree(robots / file, oracle, **PACKAGED[file])


@pytest.mark.parametrize("seed", range(30))
def test_random_urdfs(seed, random_urdf, oracle):
    """Random trees with oblique axes, sliding and fixed joints and branches give pinocchio's results at any tip.

    The joints off the chain, and one on it where there are two or more, are locked at random positions.
    """
    path, random = random_urdf(seed), np.random.default_rng(1000 + seed)
    tree = read_urdf(path)
    for tip in tree.leaves:
        moving = [joint.name for joint in tree.path(tip) if joint.moves]
        if not moving:
            continue
        if len(moving) > 1:
            moving.pop(int(random.integers(len(moving))))
        others = [joint.name for joint in tree.joints.values() if joint.moves and joint.name not in moving]
        locked = {name: random.uniform(-2, 2) for name in others}
        agree(path, oracle, seed, tip=tip, locked=locked)
        assert tree.chain(tip=tip, locked=locked).names == tuple(moving)
        assert tree.chain(joints=moving, locked=locked).names == tuple(moving)


@pytest.mark.parametrize("seed", range(5))
def test_the_flange_is_the_tip_link(seed, random_urdf, oracle):
    """The flange's pose is that of the tip link, fixed and locked joints after the last moving one included."""
    path = random_urdf(seed)
    tree = read_urdf(path)
    for tip in tree.leaves:
        if not any(joint.moves for joint in tree.path(tip)):
            continue
        taken = tree.chain(tip=tip)
        model = oracle(path, taken.names)
        q = np.full(len(taken.names), 0.3)
        frame = model.model.frames[model.model.getFrameId(tip)]
        parent = model.names.index(model.model.names[frame.parentJoint])
        expected = model.transforms(q)[parent] @ frame.placement.homogeneous
        np.testing.assert_allclose(taken.chain.flange(q), expected, atol=1e-12)
