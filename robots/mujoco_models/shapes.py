"""The shapes that an MJCF draws about its bodies, and the pairs of bodies whose contacts it leaves out."""

from __future__ import annotations

from functools import lru_cache
from itertools import combinations
from pathlib import Path
from typing import Any, Literal

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from robots.common.arrays import Array
from robots.geometry.urdf_shapes import UrdfShape
from robots.mujoco_models.elements import MujocoNames, pose
from robots.mujoco_models.files import compile_mjcf, mujoco_library

KINDS = {2: "sphere", 3: "capsule", 5: "cylinder", 6: "box"}
ELLIPSOID, MESH = 4, 7
ROUND = 12  # points along a meridian of an ellipsoid


@lru_cache(maxsize=8)
def _compiled(file: str) -> tuple[Any, MujocoNames]:
    library, model = mujoco_library(file), compile_mjcf(Path(file), warn=False)
    return model, MujocoNames(library, model)


def mjcf_shapes(file: str | Path, use: Literal["collision", "visual"]) -> dict[str, tuple[UrdfShape, ...]]:
    """Reads the geoms of an MJCF: those that take part in contacts, or those that do not.

    A mesh is its convex hull, as in MuJoCo's own contacts. Planes and height fields are no shapes of a body.

    Args:
        file: the MJCF.
        use: which geoms.

    Returns:
        Body to its shapes; bodies without any are left out.

    Raises:
        InputError: MuJoCo refuses the file, or is not installed.
    """
    model, names = _compiled(str(file))
    found: dict[str, list[UrdfShape]] = {}
    for geom in range(model.ngeom):
        if _touches(model, geom) == (use == "collision"):
            shape = _shape(model, geom, names.bodies[model.geom_bodyid[geom]])
            if shape is not None:
                found.setdefault(shape.link, []).append(shape)
    return {link: tuple(shapes) for link, shapes in found.items()}


def left_out_pairs(file: str | Path) -> tuple[frozenset[str], ...]:
    """Lists the pairs of bodies between which an MJCF has no contacts, by <exclude> or by the bits of their geoms.

    Args:
        file: the MJCF.
    """
    model, names = _compiled(str(file))
    geoms: dict[int, list[int]] = {}
    for geom in range(model.ngeom):
        if _touches(model, geom):
            geoms.setdefault(int(model.geom_bodyid[geom]), []).append(geom)
    stated = {(int(s) >> 16, int(s) & 0xFFFF) for s in model.exclude_signature}
    return tuple(
        frozenset((names.bodies[a], names.bodies[b]))
        for a, b in combinations(geoms, 2)
        if {(a, b), (b, a)} & stated or not any(_bits(model, i, j) for i in geoms[a] for j in geoms[b])
    )


def _touches(model: Any, geom: int) -> bool:
    return bool(model.geom_contype[geom] | model.geom_conaffinity[geom])


def _bits(model: Any, one: int, other: int) -> bool:
    types, affinities = model.geom_contype, model.geom_conaffinity
    return bool((types[one] & affinities[other]) | (types[other] & affinities[one]))


def _shape(model: Any, geom: int, link: str) -> UrdfShape | None:
    kind, size = int(model.geom_type[geom]), np.array(model.geom_size[geom], dtype=float)
    at = pose(model.geom_pos[geom], model.geom_quat[geom])
    if kind in (ELLIPSOID, MESH):
        points = _ellipsoid(size) if kind == ELLIPSOID else _mesh(model, int(model.geom_dataid[geom]))
        try:
            hull = ConvexHull(points)
        except QhullError:
            return None  # a flat mesh is no body
        return UrdfShape(link=link, kind="mesh", pose=at, surface=(points, hull.simplices.astype(np.int64)))
    if kind not in KINDS:
        return None
    # MuJoCo states half of the edges and half of the length.
    sizes = {"sphere": size[:1], "box": 2 * size}.get(KINDS[kind], np.array([size[0], 2 * size[1]]))
    return UrdfShape(link=link, kind=KINDS[kind], pose=at, size=tuple(map(float, sizes)))  # type: ignore[arg-type]


def _mesh(model: Any, mesh: int) -> Array:
    first = int(model.mesh_vertadr[mesh])
    return np.array(model.mesh_vert[first : first + int(model.mesh_vertnum[mesh])], dtype=float)


def _ellipsoid(half: Array) -> Array:
    u, v = np.meshgrid(np.linspace(0, np.pi, ROUND), np.linspace(0, 2 * np.pi, 2 * ROUND, endpoint=False))
    points = np.column_stack([(np.sin(u) * np.cos(v)).ravel(), (np.sin(u) * np.sin(v)).ravel(), np.cos(u).ravel()])
    return np.unique(np.round(points, 12), axis=0) * half
