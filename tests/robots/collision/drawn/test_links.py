"""Capsules about the collision shapes of a URDF: they enclose what is drawn, and coal agrees."""

from __future__ import annotations

import warnings

import coal
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robots.collision import collision_model
from robots.collision.drawn.fitting import Balls, fit_capsule
from robots.collision.drawn.links import drawn_links
from robots.common.errors import AssumedValueWarning, InputError
from robots.geometry.chain import homogeneous
from robots.loading import load_robot

BODY = '<inertial><mass value="1"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>'
LIMIT = '<limit lower="-2" upper="2" velocity="1" effort="1"/>'
POSE = '<origin xyz="0.02 0.01 0.15" rpy="0.1 0.2 0.3"/>'


def drawn(inner, pose=POSE):
    """A collision element."""
    return f"<collision>{pose}<geometry>{inner}</geometry></collision>"


def urdf(*bodies, base="", tool=""):
    """A chain of links with shapes, each 0.4 m above the one before, with a tool fixed to the last."""
    text = f'<robot name="drawn"><link name="base">{base}</link>'
    parent = "base"
    for i, inner in enumerate(bodies, start=1):
        text += f'<link name="part{i}">{BODY}{inner}</link><joint name="j{i}" type="revolute"><parent link="{parent}"/>'
        text += f'<child link="part{i}"/><origin xyz="0 0 0.4"/><axis xyz="0 {i % 2} {1 - i % 2}"/>{LIMIT}</joint>'
        parent = f"part{i}"
    text += f'<link name="tool">{tool}</link><joint name="f" type="fixed"><parent link="{parent}"/>'
    return text + '<child link="tool"/><origin xyz="0 0 0.3" rpy="0 1 0"/></joint></robot>'


@pytest.fixture
def write(tmp_path):
    """Writes a URDF and, beside it, an L of two bars as a mesh in millimetres."""

    def make(text):
        corners = []
        for low, high in (([0, 0, 0], [400, 40, 40]), ([0, 0, 40], [40, 40, 300])):
            corners += [[(low, high)[k][i] for i, k in enumerate(p)] for p in np.ndindex(2, 2, 2)]
        faces = [(1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4)]
        lines = [f"v {x} {y} {z}" for x, y, z in corners]
        lines += [f"f {' '.join(str(v + 8 * bar) for v in face)}" for bar in (0, 1) for face in faces]
        (tmp_path / "meshes").mkdir(exist_ok=True)
        (tmp_path / "meshes" / "angle.obj").write_text("\n".join(lines) + "\n")
        path = tmp_path / "drawn.urdf"
        path.write_text(text)
        return path

    return make


BOX, CYLINDER = '<box size="0.1 0.06 0.3"/>', '<cylinder radius="0.05" length="0.3"/>'
SPHERE, CAPSULE = '<sphere radius="0.08"/>', '<capsule radius="0.04" length="0.2"/>'
MESH = '<mesh filename="meshes/angle.obj" scale="0.001 0.001 0.001"/>'
MADE = {
    BOX: lambda: coal.Box(0.1, 0.06, 0.3),
    CYLINDER: lambda: coal.Cylinder(0.05, 0.3),
    SPHERE: lambda: coal.Sphere(0.08),
    CAPSULE: lambda: coal.Capsule(0.04, 0.2),
}


def distance_outside(capsules, points):
    """How far the farthest point is outside of all capsules."""
    depths = []
    for capsule in capsules:
        spine = capsule.end - capsule.start
        share = np.clip((points - capsule.start) @ spine / max(spine @ spine, 1e-30), 0, 1)
        depths.append(np.linalg.norm(points - capsule.start - share[:, None] * spine, axis=1) - capsule.radius)
    return np.min(depths, axis=0).max()


def surface(inner):
    """Points of a shape's surface, drawn by its definition."""
    random = np.random.default_rng(0)
    if inner == BOX:
        points = random.uniform(-1, 1, (3000, 3))
        points[np.arange(3000), random.integers(0, 3, 3000)] = random.choice([-1, 1], 3000)
        return points * [0.05, 0.03, 0.15]
    ball = random.normal(size=(3000, 3))
    ball /= np.linalg.norm(ball, axis=1)[:, None]
    if inner == SPHERE:
        return 0.08 * ball
    if inner == CAPSULE:
        return 0.04 * ball + np.where(ball[:, 2:] > 0, 1, -1) * [0, 0, 0.1]
    angle = random.uniform(0, 2 * np.pi, 3000)
    end = np.column_stack([np.cos(angle), np.sin(angle), np.full(3000, 1.0)]) * [0.05, 0.05, 0.15]
    return np.concatenate([end, end * [1, 1, -1]])


@pytest.mark.parametrize("inner", [BOX, CYLINDER, SPHERE, CAPSULE], ids=["box", "cylinder", "sphere", "capsule"])
def test_primitive_shapes_are_enclosed(inner, write):
    """Each point of a shape's surface is inside its capsule, which is not much larger; it is the right link's."""
    robot = load_robot(write(urdf(drawn(inner), tool="")))
    found = drawn_links(robot)
    pose = homogeneous(Rotation.from_euler("xyz", [0.1, 0.2, 0.3]).as_matrix(), [0.02, 0.01, 0.15])
    points = surface(inner) @ pose[:3, :3].T + pose[:3, 3]
    (capsule,) = found.capsules
    assert (capsule.link, capsule.name, capsule.source) == (1, "part1", "derived")
    assert distance_outside(found.capsules, points) < 1e-9
    own = {BOX: 0.1 * 0.06 * 0.3, CYLINDER: np.pi * 0.05**2 * 0.3, SPHERE: 4 / 3 * np.pi * 0.08**3}
    own[CAPSULE] = np.pi * 0.04**2 * (0.2 + 4 / 3 * 0.04)
    length = np.linalg.norm(capsule.end - capsule.start)
    volume = np.pi * capsule.radius**2 * (length + 4 / 3 * capsule.radius)
    # The least capsule about this box is 2.5 times the box; those about a sphere and a capsule are themselves.
    assert volume < own[inner] * {BOX: 2.7, CYLINDER: 1.6}.get(inner, 1.0 + 1e-6)


@pytest.mark.slow
def test_a_mesh_is_cut_into_parts(write):
    """An L of two bars, loaded by coal in its scale, is enclosed by several capsules much thinner than one."""
    robot = load_robot(write(urdf(drawn(MESH, ""))))
    found = drawn_links(robot)
    random = np.random.default_rng(0)
    bars = (([0, 0, 0], [0.4, 0.04, 0.04]), ([0, 0, 0.04], [0.04, 0.04, 0.3]))
    points = np.concatenate([random.uniform(low, high, (2000, 3)) for low, high in bars])
    assert distance_outside(found.capsules, points) < 1e-9
    alone = fit_capsule(Balls(centres=points, radii=np.zeros(len(points))))
    volumes = [np.pi * c.radius**2 * (np.linalg.norm(c.end - c.start) + 4 / 3 * c.radius) for c in found.capsules]
    assert len(found.capsules) > 1
    assert sum(volumes) < 0.8 * alone.volume


@pytest.mark.slow
def test_coal_confirms_on_the_shapes(write):
    """In random poses, the distance of the shapes by coal is never below the clearance of their capsules."""
    shapes = [BOX, CYLINDER, CAPSULE, SPHERE]
    robot = load_robot(write(urdf(*map(drawn, shapes))))
    model = collision_model(robot)
    assert model.assumed == ("base",)
    placed = homogeneous(Rotation.from_euler("xyz", [0.1, 0.2, 0.3]).as_matrix(), [0.02, 0.01, 0.15])
    checked = 0
    for q in np.random.default_rng(1).uniform(-2, 2, (60, robot.n)):
        poses, clearance = robot.chain.transforms(q), model.clearance(q)[0]
        for pair, least in zip(model.pairs, clearance, strict=True):
            if pair.first.link == 0:
                continue
            bodies = []
            for link in (pair.first.link, pair.second.link):
                pose = poses[link - 1] @ placed
                bodies += [MADE[shapes[link - 1]](), coal.Transform3s(pose[:3, :3].copy(), pose[:3, 3].copy())]
            result = coal.DistanceResult()
            distance = coal.distance(*bodies, coal.DistanceRequest(), result)
            if distance > 0:
                assert distance > least - 1e-6
                checked += 1
            else:
                assert least < 0
    assert checked > 50


@pytest.mark.slow
def test_what_is_fixed_to_a_link_moves_with_it(write):
    """A tool's shape belongs to the body that carries it; a locked joint stands as it is locked."""
    path = write(urdf(drawn(BOX), drawn(BOX), tool=drawn(SPHERE, "")))
    found = drawn_links(load_robot(path))
    tool = next(capsule for capsule in found.capsules if capsule.name == "tool")
    assert tool.link == 2
    np.testing.assert_allclose(tool.start, [0, 0, 0.3], atol=1e-12)
    locked = drawn_links(load_robot(path, locked={"j2": 1.0}))
    tool = next(capsule for capsule in locked.capsules if capsule.name == "tool")
    assert tool.link == 1
    # Joint 2 turns about z here, on which the tool lies.
    np.testing.assert_allclose(tool.start, [0, 0, 0.7], atol=1e-12)


@pytest.mark.slow
def test_many_shapes_of_a_link_are_joined(write):
    """A link of many small shapes gets a few capsules, which enclose them all."""
    boxes = "".join(drawn('<box size="0.02 0.02 0.02"/>', f'<origin xyz="0 0 {0.03 * i}"/>') for i in range(9))
    found = drawn_links(load_robot(write(urdf(boxes))))
    assert len(found.capsules) == 1
    centres = np.array([[0, 0, 0.03 * i] for i in range(9)])
    assert distance_outside(found.capsules, centres) < -0.009


@pytest.mark.slow
def test_boxes_of_the_base_are_boxes(write):
    """A table that the base stands on stays a box, and may touch the first link."""
    base = drawn('<box size="1.2 0.8 0.04"/>', '<origin xyz="0 0 -0.02"/>') + drawn(
        CYLINDER, '<origin xyz="0 0 0.15"/>'
    )
    model = collision_model(load_robot(write(urdf(drawn(BOX), drawn(BOX), base=base))))
    (table,) = model.obstacles
    assert table.name == "base box 1"
    np.testing.assert_array_equal(table.size, [1.2, 0.8, 0.04])
    assert "base box 1 / part2" in model.names
    assert ("base box 1 / part1", "to be ignored") in model.excluded
    assert model.assumed == ()


def test_links_without_shapes_are_assumed(write):
    """A link without a shape, or with a mesh that is not there, gets the assumed capsule, and warnings say so."""
    path = write(urdf(drawn(BOX), "", drawn('<mesh filename="none.stl"/>'), base=drawn(SPHERE)))
    with pytest.warns(AssumedValueWarning) as caught:
        model = collision_model(load_robot(path))
    text = " ".join(str(warning.message) for warning in caught)
    assert "the mesh none.stl of link 'part3' was not found" in text
    assert "assumed values without a source" in text
    assert set(model.assumed) == {"link 2", "link 3"}


@pytest.mark.slow
def test_meshes_of_packages(write, tmp_path):
    """``package://`` paths are found without ROS."""
    path = write(urdf(drawn('<mesh filename="package://my_arm/meshes/angle.obj" scale="0.001 0.001 0.001"/>')))
    (tmp_path / "package.xml").write_text("<package><name>my_arm</name></package>")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message="drawn: assumed")
        assert len(drawn_links(load_robot(path)).capsules) > 1


@pytest.mark.parametrize(
    ("inner", "message"),
    [
        ('<box size="1 2"/>', r"link 'part1': <box> size is '1 2'; allowed: 3"),
        ('<sphere radius="0"/>', r"link 'part1': <sphere> has the size 0; allowed: positive"),
        ('<cylinder radius="1"/>', r"<cylinder> length is missing"),
        ('<mesh scale="1 1 1"/>', r"<mesh> filename is missing"),
        ("", r"link 'part1': <collision> has no shape"),
    ],
)
def test_impossible_shapes_are_refused(inner, message, write):
    """A shape without a size is refused with its link."""
    robot = load_robot(write(urdf(drawn(inner))))
    with pytest.raises(InputError, match=message):
        collision_model(robot)


@pytest.mark.slow
def test_a_yaml_over_a_urdf_has_its_shapes(write):
    """A robot YAML that states no capsules takes the shapes of its URDF; stated ones replace them."""
    path = write(urdf(drawn(BOX), drawn(BOX)))
    (path.parent / "a.yaml").write_text("name: a\nurdf: drawn.urdf\ncollision: {floor: -0.5}\n")
    model = collision_model(load_robot(path.parent / "a.yaml"))
    assert {capsule.name for capsule in model.capsules} == {"base", "part1", "part2"}
    assert model.obstacles[0].name == "floor"
    own = "collision: {links: [{link: 1, start: [0, 0, 0], end: [0, 0, 1], radius: 0.1}]}\n"
    (path.parent / "a.yaml").write_text("name: a\nurdf: drawn.urdf\n" + own)
    assert [capsule.name for capsule in collision_model(load_robot(path.parent / "a.yaml")).capsules] == ["link 1"]


@pytest.mark.parametrize("seed", range(4))
def test_a_fit_encloses_any_balls(seed):
    """Random balls are enclosed, and no worse than by the sphere about them."""
    random = np.random.default_rng(seed)
    balls = Balls(centres=random.normal(size=(40, 3)) * [1, 0.3, 0.1], radii=random.uniform(0, 0.2, 40))
    found = fit_capsule(balls)
    spine = found.end - found.start
    share = np.clip((balls.centres - found.start) @ spine / (spine @ spine), 0, 1)
    distance = np.linalg.norm(balls.centres - found.start - share[:, None] * spine, axis=1)
    assert (distance + balls.radii <= found.radius).all()
    middle = balls.centres.mean(axis=0)
    around = (np.linalg.norm(balls.centres - middle, axis=1) + balls.radii).max()
    assert found.volume < 4 / 3 * np.pi * around**3
