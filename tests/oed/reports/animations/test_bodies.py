"""What is drawn of a robot: meshes and shapes of its URDF, capsules where it has none, and its obstacles."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from oed.reports.animations.bodies import TRIANGLES, bodies_of
from robots.common.errors import AssumedValueWarning
from robots.loading import load_robot

BODY = '<inertial><mass value="1"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>'
TETRAHEDRON = """solid t
facet normal 0 0 -1
outer loop
vertex 0 0 0
vertex 0 100 0
vertex 100 0 0
endloop
endfacet
facet normal 0 -1 0
outer loop
vertex 0 0 0
vertex 100 0 0
vertex 0 0 200
endloop
endfacet
facet normal -1 0 0
outer loop
vertex 0 0 0
vertex 0 0 200
vertex 0 100 0
endloop
endfacet
facet normal 1 1 1
outer loop
vertex 100 0 0
vertex 0 100 0
vertex 0 0 200
endloop
endfacet
endsolid t
"""


def urdf(folder: Path, first: str, second: str) -> Path:
    """Two links with what is drawn of them, beside a tetrahedron in millimetres."""
    joint = '<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/><origin xyz="0 0 0.4"/>'
    joint += '<axis xyz="0 0 1"/><limit lower="-2" upper="2" velocity="1" effort="10"/></joint>'
    text = '<robot name="drawn"><link name="base"/>'
    text += f'<link name="one">{BODY}{first}</link><link name="two">{BODY}{second}</link>'
    text += joint.format("a", "base", "one") + joint.format("b", "one", "two") + "</robot>"
    (folder / "part.stl").write_text(TETRAHEDRON)
    path = folder / "drawn.urdf"
    path.write_text(text)
    return path


def visual(inner: str, use: str = "visual") -> str:
    return f'<{use}><origin xyz="0 0 0.1"/><geometry>{inner}</geometry></{use}>'


MESH = '<mesh filename="part.stl" scale="0.001 0.001 0.001"/>'


def test_meshes_are_drawn(tmp_path: Path) -> None:
    """A visual mesh is drawn at its place and scale, a link without visual shapes by its collision shapes."""
    path = urdf(
        tmp_path,
        visual(MESH) + visual('<box size="1 1 1"/>', "collision"),
        visual('<sphere radius="0.1"/>', "collision"),
    )
    mesh, ball, floor = bodies_of(load_robot(path))
    assert floor.kind == "plane"
    assert (mesh.kind, mesh.link, ball.kind, ball.link) == ("mesh", 1, "shape", 2)
    assert len(mesh.surface.triangles) == 4
    np.testing.assert_allclose(mesh.surface.vertices.min(axis=0), [0, 0, 0.1], atol=1e-9)
    np.testing.assert_allclose(mesh.surface.vertices.max(axis=0), [0.1, 0.1, 0.3], atol=1e-9)
    np.testing.assert_allclose(ball.surface.vertices.max(axis=0)[2], 0.2, atol=1e-9)


def test_missing_meshes_become_capsules(tmp_path: Path) -> None:
    """A mesh that is not there is named, and capsules are drawn."""
    robot = load_robot(urdf(tmp_path, visual('<mesh filename="gone.stl"/>'), visual('<box size="0.1 0.1 0.1"/>')))
    with pytest.warns(AssumedValueWarning, match=r"gone\.stl"):
        bodies = bodies_of(robot)
    assert {(body.kind, body.link) for body in bodies} >= {("capsule", 1), ("shape", 2)}


def test_moved_files_become_capsules(tmp_path: Path) -> None:
    """A robot whose file has moved is drawn by capsules along its links."""
    path = urdf(tmp_path, visual(MESH), visual(MESH))
    robot = load_robot(path)
    path.unlink()
    with pytest.warns(AssumedValueWarning, match="capsules are drawn instead"):
        bodies = bodies_of(robot)
    assert {body.kind for body in bodies} == {"capsule"}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["er3a", "ur10", "panda"])
def test_robots_of_the_catalogue(name: str) -> None:
    """Every moving link but a wrist's hidden ones is drawn, with few triangles."""
    robot = load_robot(name)
    bodies = bodies_of(robot)
    assert len({body.link for body in bodies} - {0}) >= robot.n - 3
    assert sum(len(body.surface.triangles) for body in bodies) <= TRIANGLES


@pytest.mark.slow
def test_obstacles_are_drawn(tmp_path: Path) -> None:
    """Floor, box and capsule of a robot's file are drawn where they stand."""
    source = (Path(__file__).parents[4] / "robots" / "catalog" / "er3a.yaml").read_text(encoding="utf-8")
    stated = (
        "\ncollision:\n  floor: -0.2\n  boxes:\n    - {name: table, size: [0.4, 0.2, 0.6], xyz: [1.0, 0.0, 0.3]}\n"
        "  capsules:\n    - {name: post, start: [0, 1, 0], end: [0, 1, 1], radius: 0.05}\n"
    )
    path = tmp_path / "cell.yaml"
    head, _, _ = source.partition("\ncollision:")
    path.write_text(head + stated)
    bodies = {body.name: body for body in bodies_of(load_robot(path))}
    np.testing.assert_allclose(bodies["floor"].surface.vertices[:, 2], -0.2)
    np.testing.assert_allclose(bodies["table"].surface.vertices.max(axis=0), [1.2, 0.1, 0.6])
    assert bodies["post"].kind == "obstacle"
    assert bodies["floor"].kind == "plane"
