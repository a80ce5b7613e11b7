"""Surfaces of triangles: of capsules, boxes, cylinders and spheres, and of meshes with fewer triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robots.common.arrays import Array

Indices = NDArray[np.int64]

ROUND = 16  # points of a circle
CAP = 4  # rings of a half-sphere
FINEST = 256  # cells along the longest edge of a mesh, at the start of the search


@dataclass(frozen=True, eq=False)
class Surface:
    """Triangles in the frame of their body.

    Attributes:
        vertices: (k, 3) [m].
        triangles: (m, 3) indices of vertices, counter-clockwise seen from outside where `closed`.
        closed: whether the triangles enclose a body and all face outward.
    """

    vertices: Array
    triangles: Indices
    closed: bool = True

    def moved(self, pose: Array) -> Surface:
        """Gives the surface in another frame. ``pose`` (4, 4) is the pose of its own frame there."""
        return Surface(self.vertices @ pose[:3, :3].T + pose[:3, 3], self.triangles, self.closed)


def capsule_surface(start: Array, end: Array, radius: float) -> Surface:
    """Makes the surface of a capsule.

    Args:
        start: (3,) of its spine [m].
        end: (3,); equal to `start` for a sphere.
        radius: [m].
    """
    heights = np.sin(np.linspace(-0.5 * np.pi, 0.5 * np.pi, 2 * CAP + 1))
    length = float(np.linalg.norm(end - start))
    # The equator twice, once at each end of the spine; of a sphere once.
    rings = np.concatenate([heights[: CAP + 1], heights[CAP + (length == 0.0) :]])
    along = radius * rings + np.where(np.arange(len(rings)) <= CAP, 0.0, length)
    turned = _turned(along, radius * np.sqrt(np.maximum(1.0 - rings**2, 0.0)))
    axis = (end - start) / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
    across = np.linalg.svd(axis[None, :])[2][1:]
    frame = np.stack([across[0], np.cross(axis, across[0]), axis], axis=1)
    return Surface(turned.vertices @ frame.T + start, turned.triangles)


def cylinder_surface(radius: float, length: float) -> Surface:
    """Makes the surface of a cylinder along z, its centre in the origin [m]."""
    along = 0.5 * length * np.array([-1.0, -1.0, 1.0, 1.0])
    return _turned(along, radius * np.array([0.0, 1.0, 1.0, 0.0]))


def box_surface(size: Array) -> Surface:
    """Makes the surface of a box with its centre in the origin.

    Args:
        size: (3,) lengths of the edges [m].
    """
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * np.asarray(size) / 2.0
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [corner for a, b, c, d in sides for corner in ((a, b, c), (a, c, d))]
    return Surface(corners, np.array(triangles, dtype=np.int64))


def _turned(along: Array, radii: Array) -> Surface:
    """Turns a profile about z: heights (r,) and radii (r,), from the bottom to the top [m]."""
    angle = 2.0 * np.pi * np.arange(ROUND) / ROUND
    circle = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(ROUND)])
    vertices = np.concatenate(
        [radius * circle + [0.0, 0.0, height] for height, radius in zip(along, radii, strict=True)]
    )
    here = np.arange(ROUND)
    after = (here + 1) % ROUND
    faces = []
    for ring in range(len(along) - 1):
        low, high = ring * ROUND, (ring + 1) * ROUND
        if radii[ring] > 0.0:
            faces.append(np.column_stack([low + here, low + after, high + after]))
        if radii[ring + 1] > 0.0:
            faces.append(np.column_stack([low + here, high + after, high + here]))
    return Surface(vertices, np.concatenate(faces))


def decimated(surface: Surface, most: int) -> Surface:
    """Reduces a surface to at most so many triangles: vertices in one cell of a grid become their mean.

    Clustering needs no connected and no clean mesh (Rossignac and Borrel 1993), which files of robots seldom have.

    Args:
        surface: the surface.
        most: triangles, 12 or more.
    """
    cells = FINEST
    reduced = surface
    while len(reduced.triangles) > most and cells > 1:
        reduced = _clustered(surface, cells)
        # The number of triangles grows with the square of the cells along an edge.
        cells = int(cells * min(0.95 * np.sqrt(most / max(len(reduced.triangles), 1)), 0.95))
    return reduced


def _clustered(surface: Surface, cells: int) -> Surface:
    low = surface.vertices.min(axis=0)
    size = float(np.ptp(surface.vertices, axis=0).max()) / cells or 1.0
    cell = np.floor((surface.vertices - low) / size).astype(np.int64) @ [(cells + 2) ** 2, cells + 2, 1]
    _, place, count = np.unique(cell, return_inverse=True, return_counts=True)
    place = place.reshape(-1)
    sums = np.zeros((len(count), 3))
    np.add.at(sums, place, surface.vertices)
    triangles = place[surface.triangles]
    a, b, c = triangles.T
    triangles = triangles[(a != b) & (b != c) & (a != c)]
    first = np.unique(np.sort(triangles, axis=1) @ [len(count) ** 2, len(count), 1], return_index=True)[1]
    triangles = triangles[np.sort(first)]
    used, renumbered = np.unique(triangles, return_inverse=True)
    return Surface((sums / count[:, None])[used], renumbered.reshape(-1, 3).astype(np.int64), closed=False)
