from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oed.retiming.paths import simplify, split_path
from robots.common.errors import InputError


def test_a_circle_keeps_its_shape_and_length():
    """A finely sampled circle is one piece whose spline lies on the circle and is as long."""
    angle = np.linspace(0.0, np.pi, 500)
    (piece,) = split_path(np.column_stack([np.cos(angle), np.sin(angle)]), np.ones(2))
    # Chords of 0.0063 are shorter than their arcs by a part in 600,000.
    assert piece.length == pytest.approx(np.pi, rel=1e-5)
    radius = np.linalg.norm(piece.spline(np.linspace(0.0, piece.length, 2000)), axis=1)
    np.testing.assert_allclose(radius, 1.0, atol=1e-9)
    assert piece.deviation < 1e-12


def test_length_is_measured_by_the_velocity_limits():
    """A joint twice as fast contributes half the length; a joint without a limit counts as it is."""
    (piece,) = split_path(np.array([[0.0, 0.0], [2.0, 0.0]]), np.array([4.0, np.inf]))
    assert piece.length == pytest.approx(0.5)


def test_reversals_split_the_path():
    """Where the path turns back by a right angle or more, it has to rest; gentle corners do not split it."""
    corner = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    assert len(split_path(corner, np.ones(2))) == 2
    bend = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.5]])
    assert len(split_path(bend, np.ones(2))) == 1


def test_repeated_points_are_dropped():
    """Waypoints that repeat, at the end too, change nothing."""
    points = np.array([[0.0], [0.0], [1.0], [1.0], [2.0], [2.0]])
    (piece,) = split_path(points, np.ones(1))
    assert piece.length == pytest.approx(2.0)
    assert split_path(np.ones((4, 1)), np.ones(1)) == []


@pytest.mark.parametrize("points", [np.zeros((1, 2)), np.zeros(4), np.zeros((3, 3)), np.full((3, 2), np.nan)])
def test_paths_must_be_finite_points(points):
    """A path of another shape or with NaN is refused."""
    with pytest.raises(InputError, match="shape"):
        split_path(points, np.ones(2))


@pytest.mark.slow
@given(seed=st.integers(0, 1000), tolerance=st.floats(1e-3, 1.0))
def test_simplified_polylines_stay_within_the_tolerance(seed, tolerance):
    """Each point lies within the tolerance of the leg that replaces it, and both ends are kept."""
    points = np.cumsum(np.random.default_rng(seed).normal(size=(60, 3)), axis=0) * 0.1
    vertices = simplify(points, tolerance)
    assert (vertices[0], vertices[-1]) == (0, 59)
    for a, b in pairwise(vertices):
        chord = points[b] - points[a]
        along = np.clip((points[a : b + 1] - points[a]) @ chord / (chord @ chord), 0.0, 1.0)
        distance = np.linalg.norm(points[a : b + 1] - points[a] - along[:, None] * chord, axis=1)
        assert distance.max() <= tolerance + 1e-12
