"""Capsules about balls, meshes and primitive shapes, as small as a search makes them."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.spatial import ConvexHull, QhullError

from robots.collision.drawn.shapes import mesh_tree
from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.geometry.urdf_shapes import UrdfShape, mesh_file

RIM_POINTS = 24  # points of a cylinder's rim; the polygon is drawn about it, so that it encloses the circle


@dataclass(frozen=True, kw_only=True, eq=False)
class Balls:
    """Balls whose convex hull encloses a shape: ``centres`` (k, 3) [m] and ``radii`` (k,) [m], zero for points."""

    centres: Array
    radii: Array

    def moved(self, pose: Array) -> Balls:
        """Gives the balls in another frame, of which ``pose`` (4, 4) is the pose of theirs."""
        return Balls(centres=self.centres @ pose[:3, :3].T + pose[:3, 3], radii=self.radii)

    def joined(self, other: Balls) -> Balls:
        """Gives the balls of both."""
        return Balls(
            centres=np.concatenate([self.centres, other.centres]), radii=np.concatenate([self.radii, other.radii])
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Spine:
    """A capsule: the ends of its spine (3,) and its radius [m]."""

    start: Array
    end: Array
    radius: float

    @property
    def volume(self) -> float:
        """[m3]."""
        length = float(np.linalg.norm(self.end - self.start))
        return float(np.pi * self.radius**2 * (length + 4.0 / 3.0 * self.radius))


def shape_balls(shape: UrdfShape, source: str | Path) -> list[Balls]:
    """Encloses a shape by balls, in the frame of its link; a mesh in as many parts as save volume.

    Args:
        shape: the shape.
        source: the URDF, for paths of meshes.

    Raises:
        InputError: a mesh that is not found or cannot be read.
    """
    if shape.kind == "mesh":
        return [part.moved(shape.pose) for part in _mesh_parts(*load_mesh(shape, source))]
    if shape.kind == "sphere":
        balls = Balls(centres=np.zeros((1, 3)), radii=np.array(shape.size))
    elif shape.kind == "capsule":
        balls = Balls(centres=_along(shape.size[1] / 2.0), radii=np.full(2, shape.size[0]))
    elif shape.kind == "cylinder":
        radius, length = shape.size
        angle = 2.0 * np.pi * np.arange(RIM_POINTS) / RIM_POINTS
        rim = (
            radius / np.cos(np.pi / RIM_POINTS) * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(RIM_POINTS)])
        )
        centres = np.concatenate([rim + end for end in _along(length / 2.0)])
        balls = Balls(centres=centres, radii=np.zeros(len(centres)))
    else:
        corners = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T * np.array(shape.size) / 2.0
        balls = Balls(centres=corners, radii=np.zeros(8))
    return [balls.moved(shape.pose)]


def _along(half: float) -> Array:
    return np.array([[0.0, 0.0, -half], [0.0, 0.0, half]])


def load_mesh(shape: UrdfShape, source: str | Path) -> tuple[Array, NDArray[np.int64]]:
    """Loads a mesh by coal, which reads STL, OBJ and DAE.

    Args:
        shape: a mesh.
        source: the URDF, for its path.

    Returns:
        Vertices (k, 3) [m] in the shape's frame, and triangles (m, 3) of them.

    Raises:
        InputError: a mesh that is not found or cannot be read, or coal is not installed.
    """
    mesh = mesh_tree(shape, source)
    triangles = np.array([[mesh.tri_indices(i)[j] for j in range(3)] for i in range(mesh.num_tris)], dtype=np.int64)
    vertices = np.array(mesh.vertices(), dtype=np.float64)
    if not np.isfinite(vertices).all():
        raise InputError(
            f"the mesh of link {shape.link!r} has a vertex that is not finite", file=mesh_file(shape, source)
        )
    return vertices, triangles


def _mesh_parts(vertices: Array, triangles: NDArray[np.int64]) -> list[Balls]:
    """Cuts a mesh along its longest axis while the capsules about the parts get much smaller."""
    corners = vertices[triangles]
    middle = corners.mean(axis=1)
    axis = np.linalg.eigh(np.cov((middle - middle.mean(axis=0)).T))[1][:, -1] if len(middle) > 1 else np.eye(3)[0]
    along = middle @ axis
    edges = along.min(), along.max()
    best = [_points(vertices[np.unique(triangles)])]
    volume = fit_capsule(best[0], polish=False).volume
    # A mesh is cut into three parts at most, ...
    for count in range(2, 4):
        cut = np.clip(((along - edges[0]) / (edges[1] - edges[0] or 1.0) * count).astype(int), 0, count - 1)
        parts = [_points(corners[cut == part].reshape(-1, 3)) for part in range(count) if (cut == part).any()]
        found = sum(fit_capsule(part, polish=False).volume for part in parts)
        # ... and each cut must save a quarter of the volume.
        if found < 0.75 * volume:
            best, volume = parts, found
    return best


def _points(points: Array) -> Balls:
    points = np.unique(points, axis=0)
    if len(points) > RIM_POINTS:
        # Of a flat surface all points stay.
        with contextlib.suppress(QhullError):
            points = points[ConvexHull(points).vertices]
    return Balls(centres=points, radii=np.zeros(len(points)))


def fit_capsule(balls: Balls, *, polish: bool = True) -> Spine:
    """Finds a small capsule that encloses balls.

    Args:
        balls: one or more.
        polish: whether a local search improves the best of the starts along the main axes.

    Returns:
        The capsule; it encloses the balls exactly.
    """
    centres = balls.centres
    middle = (centres.max(axis=0) + centres.min(axis=0)) / 2.0
    axes = [*np.eye(3)]
    if len(centres) > 1:
        axes += [*np.linalg.svd(centres - centres.mean(axis=0), full_matrices=False)[2]]
    starts = [start for axis in axes for start in _starts(balls, middle, axis)]
    best = min(starts, key=lambda spine: spine.volume)
    if polish and len(centres) > 2:

        def volume(ends: Array) -> float:
            return _enclosing(ends[:3], ends[3:], balls).volume

        guess = np.concatenate([best.start, best.end])
        size = max(best.radius, float(np.linalg.norm(best.end - best.start)))
        options: Any = {"maxiter": 800, "xatol": 1e-4 * size, "fatol": 1e-4 * best.volume}
        found = minimize(volume, guess, method="Nelder-Mead", options=options).x
        best = min(best, _enclosing(found[:3], found[3:], balls), key=lambda spine: spine.volume)
    return best


def _starts(balls: Balls, middle: Array, axis: Array) -> list[Spine]:
    along = (balls.centres - middle) @ axis
    across = balls.centres - middle - along[:, None] * axis
    shift = (across.max(axis=0) + across.min(axis=0)) / 2.0
    shift -= shift @ axis * axis
    radius = float((np.linalg.norm(across - shift, axis=1) + balls.radii).max())
    low, high = float((along - balls.radii).min()), float((along + balls.radii).max())
    spines = []
    for inset in (0.0, 0.5 * radius, radius):
        ends = (low + inset, high - inset) if low + inset < high - inset else ((low + high) / 2.0,) * 2
        spines.append(_enclosing(middle + shift + ends[0] * axis, middle + shift + ends[1] * axis, balls))
    return spines


def _enclosing(start: Array, end: Array, balls: Balls) -> Spine:
    """The capsule of least radius about a spine that encloses the balls."""
    direction = end - start
    length = float(direction @ direction)
    share = (
        np.clip((balls.centres - start) @ direction / length, 0.0, 1.0) if length > 0.0 else np.zeros(len(balls.radii))
    )
    distance = np.linalg.norm(balls.centres - start - share[:, None] * direction, axis=1)
    radius = float((distance + balls.radii).max()) * (1.0 + 1e-9)
    # Smooth distances need a radius: thinner bodies get one of 5 mm.
    return Spine(start=np.array(start), end=np.array(end), radius=max(radius, 0.005))
