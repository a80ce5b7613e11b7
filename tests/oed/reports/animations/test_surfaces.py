"""Surfaces of triangles: closed, facing outward, of the right size, and with fewer triangles where wanted."""

from __future__ import annotations

import numpy as np
import pytest

from oed.reports.animations.surfaces import Surface, box_surface, capsule_surface, cylinder_surface, decimated

ENDS = np.array([0.1, -0.2, 0.3]), np.array([0.4, 0.2, 0.1])


def volume(surface: Surface) -> float:
    """By the divergence theorem: positive only where the triangles face outward."""
    a, b, c = (surface.vertices[surface.triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


@pytest.mark.parametrize(
    ("surface", "exact"),
    [
        (box_surface(np.array([0.1, 0.2, 0.3])), 0.006),
        (cylinder_surface(0.2, 0.5), np.pi * 0.04 * 0.5),
        (capsule_surface(*ENDS, 0.1), np.pi * 0.01 * (np.linalg.norm(ENDS[1] - ENDS[0]) + 4 / 3 * 0.1)),
        (capsule_surface(ENDS[0], ENDS[0], 0.1), 4 / 3 * np.pi * 1e-3),
    ],
    ids=["box", "cylinder", "capsule", "sphere"],
)
def test_bodies_are_closed(surface: Surface, exact: float) -> None:
    """Each edge has two triangles of opposite sense, and the volume is that of the body but for the flat faces."""
    edges = np.concatenate([surface.triangles[:, [i, j]] for i, j in ((0, 1), (1, 2), (2, 0))])
    # Rings of radius zero have all their vertices in one place.
    _, same = np.unique(surface.vertices.round(9), axis=0, return_inverse=True)
    edges = same.reshape(-1)[edges]
    senses = sorted(map(tuple, edges[edges[:, 0] != edges[:, 1]]))
    assert senses == sorted((b, a) for a, b in senses)
    assert len(set(senses)) == len(senses)
    # A circle of 16 points has 97 % of its area; half-spheres of four rings lose some more.
    assert 0.92 * exact < volume(surface) <= exact * (1 + 1e-9)


def test_meshes_are_reduced() -> None:
    """A mesh keeps its box to a few percent and has at most the wanted number of triangles."""
    side = np.linspace(0.0, 2.0 * np.pi, 120)
    u, v = (grid.ravel() for grid in np.meshgrid(side, side))
    torus = np.column_stack([(2 + np.cos(v)) * np.cos(u), (2 + np.cos(v)) * np.sin(u), np.sin(v)])
    at = np.arange(120 * 120).reshape(120, 120)
    corners = [part.ravel() for part in (at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1])]
    triangles = np.concatenate([np.column_stack(corners)[:, [0, 1, 2]], np.column_stack(corners)[:, [0, 2, 3]]])
    reduced = decimated(Surface(torus, triangles, closed=False), 500)
    assert 100 < len(reduced.triangles) <= 500
    assert reduced.triangles.max() < len(reduced.vertices)
    np.testing.assert_allclose(np.ptp(reduced.vertices, axis=0), np.ptp(torus, axis=0), rtol=0.15)


def test_small_meshes_stay() -> None:
    """A mesh with few triangles is not changed."""
    box = box_surface(np.ones(3))
    assert decimated(box, 12) is box
