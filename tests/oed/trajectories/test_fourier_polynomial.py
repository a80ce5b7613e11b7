import casadi
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from oed.trajectories import FourierPolynomial, fourier_polynomial_basis
from robots.common.errors import InputError


def test_it_is_the_series_plus_the_quintic_of_its_boundary_conditions():
    """Series and polynomial, solved from the six conditions and differentiated by casadi, give all four quantities."""
    rng = np.random.default_rng(0)
    start, end, a, b = 0.3, -0.8, rng.normal(size=4), rng.normal(size=4)
    frequency, duration = 0.21, 7.3
    motion = FourierPolynomial.from_coefficients([[start, end, *a, *b]], frequency, duration)
    t, w = casadi.SX.sym("t"), 2 * np.pi * frequency

    def derivatives(q):
        dq = casadi.jacobian(q, t)
        ddq = casadi.jacobian(dq, t)
        return [q, dq, ddq, casadi.jacobian(ddq, t)]

    series = sum(
        a[k - 1] / (w * k) * casadi.sin(w * k * t) - b[k - 1] / (w * k) * casadi.cos(w * k * t) for k in range(1, 5)
    )
    ends = casadi.Function("s", [t], derivatives(series)[:3])
    x = casadi.SX.sym("x", 6)
    powers = sum(x[k] * t**k for k in range(6))
    rows = casadi.Function("r", [t], [casadi.jacobian(value, x) for value in derivatives(powers)[:3]])
    matrix = np.vstack([np.array(row) for time in (0.0, duration) for row in rows(time)])
    wanted = np.array([start, 0.0, 0.0, end, 0.0, 0.0])
    waves = np.array([float(value) for time in (0.0, duration) for value in ends(time)])
    solved = np.linalg.solve(matrix, wanted - waves)
    whole = series + sum(solved[k] * t**k for k in range(6))
    oracle = casadi.Function("f", [t], derivatives(whole))
    times = np.linspace(0.0, duration, 41)
    values = motion.sample(times)
    for index, time in enumerate(times):
        expected = [float(value) for value in oracle(time)]
        # The oracle's 6 by 6 system has a condition number of some 1e4.
        np.testing.assert_allclose([value[index, 0] for value in values], expected, atol=1e-10)


@settings(deadline=None)
@given(
    seed=st.integers(0, 1000),
    harmonics=st.integers(1, 8),
    frequency=st.floats(0.05, 2.0),
    duration=st.floats(0.5, 40.0),
)
def test_any_coefficients_rest_at_both_ends(seed, harmonics, frequency, duration):
    """Whatever the coefficients and the duration, it starts and ends where it should, at rest."""
    rows = np.random.default_rng(seed).normal(size=(3, 2 * harmonics + 2))
    motion = FourierPolynomial.from_coefficients(rows, frequency, duration)
    # At the ends exactly, and just inside them nearly: a rate that only holds at the very end would be no rest.
    q, dq, ddq, _ = motion.sample([0.0, duration])
    np.testing.assert_array_equal(q, rows[:, :2].T)
    np.testing.assert_array_equal(dq, 0.0)
    np.testing.assert_array_equal(ddq, 0.0)
    near = motion.sample([1e-9 * duration, duration * (1 - 1e-9)])
    steepest = np.abs(motion.sample(np.linspace(0.0, duration, 400)).dddq).max()
    # The jerk over a billionth of the duration, and the rounding of the waves.
    waves = np.abs(rows).sum() * max(1.0, 2 * np.pi * frequency * harmonics)
    assert np.abs(near.ddq).max() <= 2e-9 * duration * steepest + 1e-12 * waves * max(1.0, duration**-2)


def test_the_basis_maps_coefficients_to_kinematics():
    """The basis matrices times one joint's row of coefficients give that joint's kinematics, one column each."""
    rows = np.random.default_rng(1).normal(size=(4, 8))
    motion = FourierPolynomial.from_coefficients(rows, 0.3, 5.0)
    t = np.linspace(0.0, 5.0, 9)
    for matrix, values in zip(fourier_polynomial_basis(t, 3, 0.3, 5.0), motion.sample(t), strict=True):
        assert matrix.shape == (9, 8)
        np.testing.assert_allclose(matrix @ rows[2], values[:, 2], atol=1e-12)
    np.testing.assert_array_equal(motion.coefficients, rows)
    assert motion.harmonics == 3


def test_the_basis_has_full_rank():
    """No coefficient is redundant: the columns are independent, the constant included."""
    q = fourier_polynomial_basis(np.linspace(0.0, 10.0, 200), 5, 0.1, 10.0).q
    values = np.linalg.svd(q, compute_uv=False)
    # A quintic nearly is a slow wave; what is left of it is far above the rounding of 1e-16.
    assert values[-1] > 1e-5 * values[0]


def test_without_waves_it_is_the_minimum_jerk_move():
    """With zero coefficients it is 10 x^3 - 15 x^4 + 6 x^5, and outside its duration it stays at its ends."""
    motion = FourierPolynomial(
        start=[1.0], end=[3.0], a=np.zeros((1, 1)), b=np.zeros((1, 1)), base_frequency=1.0, duration=2.0
    )
    x = np.linspace(0.0, 1.0, 11)
    np.testing.assert_allclose(motion.sample(2 * x).q[:, 0], 1 + 2 * (10 * x**3 - 15 * x**4 + 6 * x**5), atol=1e-14)
    np.testing.assert_array_equal(motion.sample([-1.0, 9.0]).q[:, 0], [1.0, 3.0])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"end": np.zeros(3)}, "shapes"),
        ({"b": np.zeros((2, 2))}, "shapes"),
        ({"a": np.zeros((2, 0)), "b": np.zeros((2, 0))}, "shapes"),
        ({"start": np.array([0.0, np.inf])}, "finite"),
        ({"base_frequency": -1.0}, "base frequency"),
        ({"duration": 0.0}, "duration"),
    ],
)
def test_a_motion_that_makes_no_sense_is_refused(change, message):
    """Shapes that do not fit and times that are not positive are errors, rows of odd length and no harmonic too."""
    good = {name: np.zeros(2) for name in ("start", "end")} | {name: np.zeros((2, 3)) for name in ("a", "b")}
    with pytest.raises(InputError, match=message):
        FourierPolynomial(**{**good, "base_frequency": 0.1, "duration": 10.0, **change})
    with pytest.raises(InputError, match="2N\\+2"):
        FourierPolynomial.from_coefficients(np.zeros((2, 5)), 0.1, 10.0)
    with pytest.raises(InputError, match="harmonics"):
        fourier_polynomial_basis([0.0], 0, 0.1, 10.0)
