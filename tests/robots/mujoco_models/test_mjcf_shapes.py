"""The collision geometry of an MJCF, judged by MuJoCo's own contacts."""

from __future__ import annotations

import numpy as np
import pytest

from robots import load_robot
from robots.collision import collision_model
from robots.collision.drawn.links import drawn_links
from robots.collision.pairs import poses_of

mujoco = pytest.importorskip("mujoco")

INERTIAL = '<inertial pos="0 0 .2" mass="1" diaginertia=".1 .1 .1"/>'
MJCF = f"""<mujoco model="arm"><compiler angle="radian"/>
<asset><mesh name="hand" vertex="-.03 -.03 0 .03 -.03 0 0 .04 0 0 0 .08"/></asset>
<worldbody><geom type="plane" size="5 5 .1"/><body name="base" pos="0 0 .1"><geom type="cylinder" size=".08 .1"/>
<body name="l1" pos="0 0 .12"><joint name="j1" axis="0 0 1" range="-3 3"/>{INERTIAL}<geom type="sphere" size=".07"/>
<body name="l2" pos="0 0 .05"><joint name="j2" axis="0 1 0" range="-2.8 2.8"/>{INERTIAL}
<geom type="capsule" fromto="0 0 .05 0 0 .35" size=".04"/>
<body name="l3" pos="0 0 .4"><joint name="j3" axis="0 1 0" range="-2.9 2.9"/>{INERTIAL}
<geom type="box" pos="0 0 .2" size=".03 .03 .16"/>
<body name="l4" pos="0 0 .38"><joint name="j4" axis="0 1 0" range="-2.9 2.9"/>{INERTIAL}
<geom type="ellipsoid" pos="0 0 .1" size=".04 .03 .1"/><geom type="mesh" mesh="hand" pos=".05 0 .1"/>
<geom type="box" size="1 1 1" contype="0" conaffinity="0"/>
</body></body></body></body></body></worldbody>EXCLUDE</mujoco>"""


@pytest.fixture
def arm(tmp_path):
    """A robot with one geom of each kind; a large box on its hand takes part in no contact."""
    path = tmp_path / "arm.xml"
    path.write_text(MJCF.replace("EXCLUDE", ""))
    return load_robot(path)


def _contacts(robot, q):
    """Pairs of bodies that MuJoCo finds in contact, per pose; the base and the first link always are."""
    model = mujoco.MjModel.from_xml_path(robot.mjcf)
    data, number = mujoco.MjData(model), {place.name: place.body for place in robot.links}
    names = [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, i) for i in range(model.nbody)]
    found = []
    for pose in q:
        data.qpos[:] = pose
        mujoco.mj_forward(model, data)
        pairs = [[names[model.geom_bodyid[g]] for g in c.geom] for c in data.contact[: data.ncon] if c.dist < 0]
        found.append({frozenset(number[name] for name in pair) for pair in pairs if "world" not in pair})
    return found


def test_pairs_meet_where_mujoco_has_contacts(arm):
    """Shapes of bodies that are no neighbours meet in the poses of MuJoCo's contacts, but for grazing ones."""
    q = np.random.default_rng(0).uniform(arm.limits.lower, arm.limits.upper, (300, 4))
    contacts, bodies = _contacts(arm, q), drawn_links(arm).bodies
    for pair in (frozenset(p) for p in ((0, 2), (0, 3), (0, 4), (1, 3), (1, 4), (2, 4))):
        wanted = np.array([pair in found for found in contacts])
        assert wanted.any()
        # The ellipsoid is a polyhedron of 24 meridians.
        assert np.count_nonzero(bodies.meet(pair, poses_of(arm.chain, q)) != wanted) <= 1


def test_no_contact_is_missed(arm):
    """The model's clearance is negative in each pose with a contact beyond the one by construction."""
    q = np.random.default_rng(1).uniform(arm.limits.lower, arm.limits.upper, (300, 4))
    touches = np.array([bool(found - {frozenset((0, 1))}) for found in _contacts(arm, q)])
    assert touches.any()
    assert (collision_model(arm, floor=False).clearance(q)[touches].min(axis=1) < 0).all()


def test_excluded_pairs_may_touch(tmp_path):
    """A pair that the file excludes from contacts is not watched."""
    path = tmp_path / "arm.xml"
    path.write_text(MJCF.replace("EXCLUDE", '<contact><exclude body1="l2" body2="l4"/></contact>'))
    names = collision_model(load_robot(path), floor=False).names
    assert not any("l2" in name and "l4" in name for name in names)
    assert any("l1" in name and "l4" in name for name in names)
