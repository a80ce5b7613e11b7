import casadi
import numpy as np
import pytest
import scipy.interpolate
from hypothesis import given, settings
from hypothesis import strategies as st

from oed.trajectories import BSpline, bspline_basis
from robots.common.errors import InputError


def _spline(degree: int, count: int = 8, duration: float = 3.0, n: int = 2) -> BSpline:
    return BSpline(points=np.random.default_rng(degree).normal(size=(n, count)), duration=duration, degree=degree)


@pytest.mark.parametrize("degree", [3, 5])
def test_values_are_those_of_another_implementation(degree):
    """Positions are those of casadi's own B-splines, and derivatives those of its automatic differentiation."""
    spline = _spline(degree, n=1)
    t = casadi.MX.sym("t")
    controls = (spline.expansion @ spline.points[0]).tolist()
    q = casadi.bspline(t, casadi.DM(controls), [spline.knots.tolist()], [degree], 1, {})
    dq = casadi.jacobian(q, t)
    ddq = casadi.jacobian(dq, t)
    oracle = casadi.Function("f", [t], [q, dq, ddq, casadi.jacobian(ddq, t)])
    # Not at knots, where a cubic's jerk has two values.
    times = np.linspace(0.011, 2.987, 37)
    values = spline.sample(times)
    for index, time in enumerate(times):
        expected = [float(value) for value in oracle(time)]
        # Jerks of up to 1e4 rad/s^3 in double precision.
        np.testing.assert_allclose([value[index, 0] for value in values], expected, rtol=1e-11, atol=1e-11)


def test_two_points_make_the_minimum_jerk_move():
    """The smallest quintic is 10 x^3 - 15 x^4 + 6 x^5."""
    spline = BSpline(points=np.array([[1.0, 3.0]]), duration=2.0)
    x = np.linspace(0.0, 1.0, 21)
    values = spline.sample(2 * x)
    np.testing.assert_allclose(values.q[:, 0], 1 + 2 * (10 * x**3 - 15 * x**4 + 6 * x**5), atol=1e-13)
    np.testing.assert_allclose(values.dddq[:, 0], 2 / 8 * (60 - 360 * x + 360 * x**2), atol=1e-11)


@settings(deadline=None)
@given(
    degree=st.sampled_from([3, 5]), count=st.integers(2, 30), duration=st.floats(0.1, 100.0), seed=st.integers(0, 99)
)
def test_it_rests_where_it_starts_and_ends(degree, count, duration, seed):
    """It starts at the first control point and ends at the last, both at rest, also a moment inside."""
    points = np.random.default_rng(seed).normal(size=(2, count))
    spline = BSpline(points=points, duration=duration, degree=degree)
    q, dq, ddq, _ = spline.sample([0.0, duration])
    np.testing.assert_allclose(q.T, points[:, [0, -1]], atol=1e-12)
    np.testing.assert_array_equal(dq, 0.0)
    np.testing.assert_array_equal(ddq, 0.0)
    near, jerk = spline.sample([1e-9 * duration, duration * (1 - 1e-9)]), np.abs(spline.sample([0.0, duration]).dddq)
    assert np.all(np.abs(near.ddq) <= 2e-9 * duration * jerk + 1e-6 * duration**-2)


@pytest.mark.parametrize(("degree", "support"), [(3, 4), (5, 6)])
def test_a_control_point_acts_locally(degree, support):
    """An inner basis function is exactly zero outside degree + 1 knot intervals, in all derivatives."""
    count, duration = 16, 5.0
    inner = np.unique(BSpline(points=np.zeros((1, count)), duration=duration, degree=degree).knots)
    t = np.linspace(0.0, duration, 1001)
    for matrix in bspline_basis(t, count, duration, degree):
        for column in range(6, 10):
            busy = t[matrix[:, column] != 0.0]
            assert busy.max() - busy.min() <= support * inner[1] + 1e-12


@pytest.mark.parametrize("degree", [3, 5])
def test_the_basis_adds_up_to_one_and_maps_points(degree):
    """The basis is a partition of unity that is not negative, and times the control points it is the motion."""
    spline = _spline(degree)
    t = np.linspace(0.0, 3.0, 100)
    basis = spline.basis(t)
    np.testing.assert_allclose(basis.q.sum(axis=1), 1.0, atol=1e-14)
    assert basis.q.min() >= 0.0
    for matrix, values in zip(basis, spline.sample(t), strict=True):
        assert matrix.shape == (100, 8)
        np.testing.assert_allclose(matrix @ spline.points[1], values[:, 1], rtol=1e-12, atol=1e-12)
    # At either end the three columns that scipy has are one of ours.
    design = scipy.interpolate.BSpline.design_matrix(t, spline.knots, degree).toarray()
    np.testing.assert_allclose(basis.q, design @ spline.expansion, atol=1e-14)


def test_jerk_is_continuous_for_quintics_and_not_for_cubics():
    """At an inner knot the jerk of a quintic has one value, that of a cubic jumps, and the later piece counts."""
    for degree, jumps in ((5, False), (3, True)):
        spline = _spline(degree)
        knot = np.unique(spline.knots)[2]
        before, at, after = spline.sample([knot - 1e-9, knot, knot + 1e-9]).dddq[:, 0]
        assert (abs(at - before) > 1e-3) == jumps
        assert at == pytest.approx(after, rel=1e-5, abs=1e-4)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"points": np.zeros((2, 1))}, "control points"),
        ({"points": np.zeros(4)}, "dimensions"),
        ({"points": np.full((1, 4), np.nan)}, "finite"),
        ({"degree": 4}, "degree 4"),
        ({"duration": 0.0}, "duration"),
    ],
)
def test_a_spline_that_makes_no_sense_is_refused(change, message):
    """Too few points, another degree and a duration that is not positive are errors."""
    with pytest.raises(InputError, match=message):
        BSpline(**{"points": np.zeros((2, 4)), "duration": 1.0, **change})
