"""The shapes that a robot's URDF or MJCF draws, by the body that carries them, and whether those of two bodies meet."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.geometry.urdf_shapes import UrdfShape, drawn_shapes, mesh_file
from robots.robot import Robot

BodyPair = frozenset[int]


@dataclass(frozen=True, kw_only=True, eq=False)
class DrawnShape:
    """One shape on a body.

    Attributes:
        body: that carries it: 0 is the base, then the links from 1.
        pose: (4, 4) of its link in the body's frame.
        shape: as the URDF has it.
    """

    body: int
    pose: Array
    shape: UrdfShape


def shapes_by_link(robot: Robot, use: Literal["collision", "visual"]) -> dict[str, tuple[UrdfShape, ...]]:
    """Reads the shapes of a robot's URDF or MJCF by the names of its links.

    Args:
        robot: one from another file has none.
        use: which shapes: those for distances or those for pictures.

    Raises:
        InputError: naming the link, on a shape that is not possible.
    """
    if robot.mjcf:
        from robots.mujoco_models.shapes import mjcf_shapes

        return mjcf_shapes(robot.mjcf, use)
    return drawn_shapes(robot.urdf, use) if robot.urdf else {}


def left_out_pairs(robot: Robot) -> set[BodyPair]:
    """Lists the pairs of bodies between which a robot's MJCF states no contacts; none of another file."""
    if not robot.mjcf:
        return set()
    from robots.mujoco_models import shapes

    bodies = {place.name: place.body for place in robot.links}
    stated = {frozenset(bodies.get(name, -1) for name in pair) for pair in shapes.left_out_pairs(robot.mjcf)}
    return {pair for pair in stated if -1 not in pair and len(pair) == 2}


def shapes_of(robot: Robot) -> tuple[DrawnShape, ...]:
    """Reads the shapes of a robot: for each link those for collisions, else the visual ones.

    Args:
        robot: one that is neither from a URDF nor from an MJCF has none.

    Raises:
        InputError: naming the link, on a shape that is not possible.
    """
    drawn = shapes_by_link(robot, "visual") | shapes_by_link(robot, "collision")
    return tuple(
        DrawnShape(body=place.body, pose=place.pose, shape=shape)
        for place in robot.links
        for shape in drawn.get(place.name, ())
    )


def mesh_tree(shape: UrdfShape, source: str | Path) -> Any:
    """Loads a mesh by coal, which reads STL, OBJ and DAE, as a tree of boxes about its triangles.

    Args:
        shape: a mesh.
        source: the URDF, for its path.

    Raises:
        InputError: a mesh that is not found or cannot be read, or coal is not installed.
    """
    if shape.surface is not None:
        made = coal().BVHModelOBBRSS()
        made.beginModel(len(shape.surface[1]), len(shape.surface[0]))
        made.addVertices(np.asfortranarray(shape.surface[0]))
        made.addTriangles(np.asfortranarray(shape.surface[1]))
        made.endModel()
        return made
    path = mesh_file(shape, source)
    try:
        mesh = coal().MeshLoader().load(str(path), np.asarray(shape.scale))
    except (ValueError, RuntimeError) as error:
        raise InputError(f"the mesh of link {shape.link!r} cannot be read", file=path) from error
    if not mesh.num_tris:
        raise InputError(f"the mesh of link {shape.link!r} has no surface", file=path)
    return mesh


def coal() -> Any:
    """Imports coal (formerly hpp-fcl).

    Raises:
        InputError: it is not installed.
    """
    for name in ("coal", "pinocchio.hppfcl"):
        try:
            return import_module(name)
        except ImportError:
            continue
    raise InputError("the package coal is not installed", remedy="pip install coal (it comes with pin)")


@dataclass(frozen=True, eq=False)
class DrawnBodies:
    """Judges by coal whether the drawn shapes of two bodies meet.

    Attributes:
        shapes: of all bodies; those that cannot be read do not count.
        source: the URDF, for paths of meshes.
    """

    shapes: tuple[DrawnShape, ...]
    source: str

    def meet(self, pair: BodyPair, poses: Array) -> NDArray[np.bool_]:
        """Looks whether any shape of one body touches any of the other.

        Args:
            pair: two bodies.
            poses: (N, n + 1, 4, 4) of the base and the links.

        Returns:
            (N,).
        """
        first, second = sorted(pair)
        met = np.zeros(len(poses), dtype=bool)
        for a in self._bodies.get(first, ()):
            for b in self._bodies.get(second, ()):
                places = [(poses[:, body] @ local.place) for body, local in ((first, a), (second, b))]
                apart = np.linalg.norm(places[0] @ a.centre - places[1] @ b.centre, axis=1)
                for row in np.flatnonzero(~met & (apart <= a.radius + b.radius)):
                    here = [coal().Transform3s(place[row, :3, :3], place[row, :3, 3]) for place in places]
                    # Hulls are quick, and mostly apart.
                    met[row] = _meet(a.hull, b.hull, here) and _meet(a.solid, b.solid, here)
        return met

    @property
    def bodies(self) -> Collection[int]:
        """Bodies with a shape that can be read."""
        return self._bodies.keys()

    @cached_property
    def _bodies(self) -> dict[int, list[_Solid]]:
        found: dict[int, list[_Solid]] = {}
        for drawn in self.shapes:
            try:
                solid = _solid(drawn.shape, self.source)
            except InputError:
                continue  # Whoever fits capsules to the shapes has warned of it.
            solid.computeLocalAABB()
            centre = np.append(np.asarray(solid.aabb_center), 1.0)
            place = drawn.pose @ drawn.shape.pose
            found.setdefault(drawn.body, []).append(
                _Solid(solid, _hull(solid), place, centre, float(solid.aabb_radius))
            )
        return found

    def __getstate__(self) -> dict[str, object]:
        # Shapes of coal are loaded again in the process that needs them.
        return {"shapes": self.shapes, "source": self.source}

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)


@dataclass(frozen=True, eq=False)
class _Solid:
    """A shape of coal, its convex hull, its pose (4, 4) on the body, and a ball about it: (4,), [m]."""

    solid: Any
    hull: Any
    place: Array
    centre: Array
    radius: float


def _meet(first: Any, second: Any, places: list[Any]) -> bool:
    result = coal().CollisionResult()  # A used one would still hold the last contact.
    return bool(coal().collide(first, places[0], second, places[1], coal().CollisionRequest(), result) > 0)


def _solid(shape: UrdfShape, source: str) -> Any:
    if shape.kind == "mesh":
        return mesh_tree(shape, source)
    make = {"box": "Box", "sphere": "Sphere", "cylinder": "Cylinder", "capsule": "Capsule"}[shape.kind]
    return getattr(coal(), make)(*shape.size)


def _hull(solid: Any) -> Any:
    """The convex hull of a mesh; a flat mesh and the other shapes stay as they are."""
    if not hasattr(solid, "buildConvexHull"):
        return solid
    try:
        solid.buildConvexHull(False, "Qt")
    except (ValueError, RuntimeError):
        return solid
    return solid.convex
