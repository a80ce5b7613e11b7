"""Inertial parameters about a frame of choice."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robots.common.errors import InputError
from robots.geometry.chain import homogeneous
from robots.geometry.inertia import check_body, inertial_parameters, symmetric


def test_the_parameters_are_those_of_the_bodys_points():
    """Of a cloud of points, the parameters about any frame are the sums over its points."""
    random = np.random.default_rng(1)
    points, masses = random.normal(size=(30, 3)), random.uniform(0.1, 1.0, size=30)
    pose = homogeneous(Rotation.random(rng=random).as_matrix(), random.normal(size=3))

    def inertia(at):
        return sum(m * (p @ p * np.eye(3) - np.outer(p, p)) for m, p in zip(masses, at, strict=True))

    com = masses @ points / masses.sum()
    seen = points @ pose[:3, :3].T + pose[:3, 3]
    about_origin = inertia(seen)
    expected = [masses.sum(), *(masses @ seen), *about_origin[np.triu_indices(3)]]
    found = inertial_parameters(masses.sum(), com, inertia(points - com), pose)
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)  # sums of 30 numbers of size 10


def test_six_numbers_make_a_symmetric_matrix():
    """The order is xx, xy, xz, yy, yz, zz."""
    np.testing.assert_array_equal(symmetric([1, 2, 3, 4, 5, 6]), [[1, 2, 3], [2, 4, 5], [3, 5, 6]])


def test_bodies_that_files_really_hold_pass():
    """Frames, point masses, thin rods, and slight breaches of the triangle inequality are accepted."""
    check_body(0.0, np.zeros((3, 3)), "frame")
    check_body(1.0, np.zeros((3, 3)), "point")
    check_body(1.0, np.diag([0.0, 0.1, 0.1]), "rod")
    check_body(1.0, np.diag([0.1, 0.1, 0.2001]), "plate")
    check_body(1e-32, np.diag([-1e-35, 1e-35, 1e-35]), "marker")


@pytest.mark.parametrize(
    ("mass", "inertia", "message"),
    [
        (-1.0, np.eye(3), "link 'x' has a mass of -1 kg"),
        (np.nan, np.eye(3), "link 'x' has a mass of nan kg"),
        (0.0, np.eye(3), "link 'x' has an inertia of up to 1 kg m2 but no mass"),
        (1.0, np.diag([1.0, 1.0, -0.1]), "link 'x' has an inertia with a negative principal moment of -0.1"),
        (1.0, symmetric([1, 2, 0, 1, 0, 1]), "negative principal moment of -1"),
    ],
)
def test_bodies_that_cannot_be_are_refused(mass, inertia, message):
    """A negative mass, an inertia without mass and an indefinite inertia are refused, naming the body."""
    with pytest.raises(InputError, match=message):
        check_body(mass, inertia, "link 'x'")
