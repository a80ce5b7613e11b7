from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from robots.collision import exact
from robots.geometry.chain import rotation_from_rpy

# coal's capsules are exact in closed form; its boxes come from an iteration that ends at 1e-6
coal = pytest.importorskip("coal", reason="coal is the oracle of these tests")


def _capsule(start, end, radius):
    spine = end - start
    length = np.linalg.norm(spine)
    if not length:
        return coal.Sphere(radius), coal.Transform3s(np.eye(3), start)
    z = spine / length
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    x /= np.linalg.norm(x)
    return coal.Capsule(radius, length), coal.Transform3s(np.column_stack([x, np.cross(z, x), z]), (start + end) / 2)


def _coal(first, second) -> float:
    return coal.distance(*first, *second, coal.DistanceRequest(), coal.DistanceResult())


@pytest.mark.slow
def test_segments_are_as_far_apart_as_coal_says(segments):
    """The distance of 4,000 pairs of segments, parallel and degenerate ones among them, is coal's of thin capsules."""
    a0, a1, b0, b1 = segments(4000)
    ours = exact.segment_segment(a0, a1, b0, b1)
    radius = 1e-3  # coal needs some thickness
    expected = [
        _coal(_capsule(p, q, radius), _capsule(r, s, radius)) + 2 * radius
        for p, q, r, s in zip(a0, a1, b0, b1, strict=True)
    ]
    apart = ours > 2 * radius
    np.testing.assert_allclose(ours[apart], np.array(expected)[apart], rtol=0, atol=1e-6)


def test_segments_in_closed_form():
    """Crossing, parallel, collinear and end-to-end segments have the distances that one reads off."""
    o, x, y, z = np.zeros(3), *np.eye(3)
    cases = [
        ((-x, x, z - y, z + y), 1.0),
        ((o, x, y, x + y), 1.0),
        ((o, x, 3 * x, 5 * x), 2.0),
        ((o, x, 2 * x + y, 3 * x + y), 2**0.5),
        ((o, x, 0.5 * x - y, 0.5 * x + y), 0.0),
        ((o, o, x, x), 1.0),
        ((o, o, y - x, y + x), 1.0),
        ((y - x, y + x, o, o), 1.0),
    ]
    for segment, expected in cases:
        assert exact.segment_segment(*segment) == pytest.approx(expected, abs=1e-15)


def test_no_sampled_points_are_closer(segments):
    """No two of 40 x 40 points on a pair of segments are closer than their distance."""
    a0, a1, b0, b1 = segments(500, seed=1)
    share = np.linspace(0, 1, 40)[:, None, None]
    first, second = a0 + share * (a1 - a0), b0 + share * (b1 - b0)
    sampled = np.linalg.norm(first[:, None] - second[None], axis=-1).min(axis=(0, 1))
    ours = exact.segment_segment(a0, a1, b0, b1)
    assert (ours <= sampled + 1e-12).all()
    assert (ours >= sampled - 0.06).all()  # points are up to 36 mm apart, on both


@pytest.mark.slow
def test_boxes_are_as_far_as_coal_says(segments):
    """The distance of 2,000 segments to boxes of any place is coal's."""
    random = np.random.default_rng(2)
    x0, x1, centre, half = segments(2000, seed=2)
    half = np.abs(half) + 0.02
    for k in range(len(x0)):
        turn = rotation_from_rpy(random.uniform(-3, 3, 3))
        ours = exact.segment_box((x0[k] - centre[k]) @ turn, (x1[k] - centre[k]) @ turn, half[k])
        box = coal.Box(*(2 * half[k])), coal.Transform3s(turn, centre[k])
        expected = _coal(box, _capsule(x0[k], x1[k], 1e-3)) + 1e-3
        assert ours == pytest.approx(max(expected, 0), abs=2e-6 if expected > 2e-3 else 2e-3)


@pytest.mark.slow
def test_boxes_against_a_search_along_the_segment(segments):
    """The distance to a box is the smallest along the segment, also where an edge runs along a face."""
    x0, x1, half, _ = segments(300, seed=3)
    half = np.abs(half) + 0.02
    x1[:40, 2] = x0[:40, 2] = half[:40, 2]  # in the plane of a face
    x1[40:80, 1:] = x0[40:80, 1:]  # along an axis
    ours = exact.segment_box(x0, x1, half)
    for k in range(len(x0)):

        def apart(s, k=k):
            x = x0[k] + s * (x1[k] - x0[k])
            return float(np.linalg.norm(x - np.clip(x, -half[k], half[k])))

        found = min(minimize_scalar(apart, bounds=(0, 1), method="bounded", options={"xatol": 1e-10}).fun, apart(0))
        assert ours[k] <= min(found, apart(1)) + 1e-12
        assert ours[k] == pytest.approx(min(found, apart(1)), abs=1e-7)


def test_height_above_a_plane():
    """The height is that of the lower end, negative below the plane."""
    normal = np.array([0.0, 0.6, 0.8])
    assert exact.segment_plane(np.array([0, 0, 1.0]), np.array([5.0, 1, 1]), normal, 0.3) == pytest.approx(0.5)
    assert exact.segment_plane(np.array([0, 0, -1.0]), np.array([5.0, 1, 1]), normal, 0.0) == pytest.approx(-0.8)
