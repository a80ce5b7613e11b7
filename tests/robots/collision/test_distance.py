from __future__ import annotations

import casadi
import numpy as np
import pytest

from robots.batch import batch_function
from robots.collision import distance, exact

RHO, C = 0.15, 0.002


def _evaluate(build, size):
    """Values (N,) and the gradients (N, size) that casadi derives by itself."""
    x = casadi.SX.sym("x", size)
    contact = build(x)
    outputs = [contact.clearance, casadi.jacobian(contact.clearance, x), contact.direction, contact.point]
    return batch_function(casadi.Function("f", [x], outputs), "vectorised")


@pytest.fixture(scope="module")
def pair():
    return _evaluate(lambda x: distance.segment_segment((x[:3], x[3:6]), (x[6:9], x[9:]), (False, False), RHO, C), 12)


POSE = np.eye(4)
HALF = np.array([0.1, 0.2, 0.15])


@pytest.fixture(scope="module")
def box():
    return _evaluate(lambda x: distance.segment_box((x[:3], x[3:]), False, POSE, HALF, RHO, C), 6)


@pytest.fixture(scope="module")
def plane():
    normal = np.array([0.0, 0.6, 0.8])
    return _evaluate(lambda x: distance.segment_plane((x[:3], x[3:]), False, normal, 0.1, RHO, C), 6)


def _bounds_hold(h, d):
    rounding = 1e-12
    assert (h <= np.where(d >= RHO / 2, d - RHO, -RHO / 2) + rounding).all()
    assert (h[d >= RHO] >= (d - RHO - C)[d >= RHO] - rounding).all()
    assert (h >= d - RHO - 2 * C - rounding).all()
    assert ((h < 0) >= (d < RHO)).all()


def test_the_clearance_of_capsules_is_a_little_small_and_never_too_large(pair, segments):
    """On 20,000 pairs of segments, h lies between d - rho - c and d - rho (and within 2 c of it in a collision)."""
    a0, a1, b0, b1 = segments(20000)
    h = pair(np.hstack([a0, a1, b0, b1]))[0][:, 0, 0]
    _bounds_hold(h, exact.segment_segment(a0, a1, b0, b1))


def test_the_stated_smoothing_is_used_up(pair):
    """Capsules that touch with the middles of their spines are c too small, with the ends of them exact."""
    crossed = np.array([[-0.2, 0, 0, 0.2, 0, 0, 0, RHO, -0.2, 0, RHO, 0.2]])
    assert pair(crossed)[0].item() == pytest.approx(-C, abs=1e-15)
    in_line = np.array([[0, 0, 0, 0.2, 0, 0, 0.2 + RHO, 0, 0, 0.5, 0, 0]])
    assert pair(in_line)[0].item() == pytest.approx(0, abs=1e-15)


def test_the_clearance_from_a_box_keeps_the_same_bounds(box, segments):
    """On 20,000 segments and a box, h keeps the bounds of two capsules."""
    x0, x1, _, _ = segments(20000, seed=5)
    x0, x1 = 1.5 * x0, 1.5 * x1
    x0[:50, 2] = x1[:50, 2]
    h = box(np.hstack([x0, x1]))[0][:, 0, 0]
    _bounds_hold(h, exact.segment_box(x0, x1, HALF))


def test_the_height_above_a_plane_keeps_its_bound(plane, segments):
    """On 20,000 segments and a plane, h lies between the height less c and the height."""
    x0, x1, _, _ = segments(20000, seed=6)
    d = exact.segment_plane(x0, x1, np.array([0.0, 0.6, 0.8]), 0.1)
    h = plane(np.hstack([x0, x1]))[0][:, 0, 0]
    assert (h <= d - RHO + 1e-12).all()
    assert (h >= d - RHO - C - 1e-12).all()


@pytest.mark.parametrize("kind", ["pair", "box", "plane"])
def test_direction_and_point_are_the_gradient(kind, request, segments):
    """Moving the second body rigidly changes h by direction and point alone, as casadi's own derivative says."""
    function, size = request.getfixturevalue(kind), 12 if kind == "pair" else 6
    x = np.hstack(list(segments(3000, seed=7)))[:, 12 - size :]
    h, gradient, direction, point = function(x)
    by_start, by_end = gradient[:, 0, -6:-3], gradient[:, 0, -3:]
    # Of spines without length (an eighth of them) casadi derives 0 / 0.
    settled = np.abs(gradient).max(axis=(1, 2)) < 10
    assert settled.mean() >= 0.85
    # casadi goes through the minimiser and divides by the small determinant of near-parallel segments
    np.testing.assert_allclose((by_start + by_end)[settled], direction[settled, :, 0], rtol=0, atol=1e-7)
    turned = np.cross(x[:, -6:-3], by_start) + np.cross(x[:, -3:], by_end)
    expected = np.cross(point[:, :, 0], direction[:, :, 0])
    np.testing.assert_allclose(turned[settled], expected[settled], rtol=0, atol=1e-7)
    assert np.isfinite(h).all()
    assert np.isfinite(direction).all()


def _sweep(function, angles):
    """A bar of 0.3 m turns in front of another one, through being parallel: h and its slope by the angle."""
    half = 0.15 * np.column_stack([np.cos(angles), np.zeros_like(angles), np.sin(angles)])
    fixed = np.tile([-0.15, 0, 0, 0.15, 0, 0], (len(angles), 1))
    centre = np.array([0.0, RHO, 0.0])
    # turned within a plane that tips towards the fixed bar
    half = half @ np.array([[1.0, 0, 0], [0, 1, 0], [0, 1, 1]])
    x = np.hstack([fixed, centre - half, centre + half])
    return function(x), x


def test_the_gradient_is_continuous_through_parallel(pair):
    """Where two bars pass through being parallel the exact slope jumps, the smooth one does not."""
    for scale in (1e-4, 1e-6, 1e-8):
        (_, _, direction, point), _ = _sweep(pair, np.array([-scale, scale]))
        moment = np.cross(point[:, :, 0], direction[:, :, 0])
        # the switch takes rho c / (d L) of a radian; within it the slope is linear
        assert np.abs(moment[1] - moment[0]).max() < 100 * scale * 0.3
    angles = np.array([-0.2, 0.2])
    (_, _, _, point), _ = _sweep(pair, angles)
    assert np.abs(point[1, 0] - point[0, 0]) > 0.2  # from one end of the bar to the other


def test_the_gradient_from_a_box_is_continuous_through_parallel_to_a_face(box):
    """Where a bar passes through being parallel to a face, the point that counts moves without a jump."""
    for scale in (1e-5, 1e-7):
        rows = [[-0.08, 0, 0.3 + s, 0.08, 0, 0.3 - s] for s in (-scale, scale)]
        point = box(np.array(rows))[3][:, :, 0]
        assert np.abs(point[1] - point[0]).max() < 100 * scale


def test_spheres_and_points_are_exact():
    """Of two spheres, of a sphere and a box or a plane, h is the exact clearance: there is nothing to smooth."""
    x = casadi.SX.sym("x", 3)
    origin = casadi.SX.zeros(3)
    sphere = distance.segment_segment((origin, origin), (x, x), (True, True), RHO, C).clearance
    box = distance.segment_box((x, x), True, POSE, HALF, RHO, C).clearance
    plane = distance.segment_plane((x, x), True, np.array([0.0, 0, 1]), 0.1, RHO, C).clearance
    f = casadi.Function("f", [x], [sphere, box, plane])
    values = [float(v) for v in f([0.1, 0.2, 0.6])]
    np.testing.assert_allclose(values, [0.41**0.5 - RHO, 0.45 - RHO, 0.5 - RHO], rtol=0, atol=1e-15)
