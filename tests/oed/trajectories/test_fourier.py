import casadi
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from oed.trajectories import FourierSeries, fourier_basis, rest_basis
from robots.common.errors import InputError


def _series(seed: int = 0, n: int = 6, harmonics: int = 5, base_frequency: float = 0.1) -> FourierSeries:
    rng = np.random.default_rng(seed)
    return FourierSeries(
        offsets=rng.normal(size=n),
        a=rng.normal(size=(n, harmonics)),
        b=rng.normal(size=(n, harmonics)),
        base_frequency=base_frequency,
    )


def test_the_series_is_thesis_equation_78_and_its_derivatives():
    """Position is eq. 78 written out; the rest are its derivatives by automatic differentiation."""
    series = _series()
    w = 2 * np.pi * 0.1
    t = casadi.SX.sym("t")
    q = casadi.vertcat(
        *[
            series.offsets[i]
            + sum(
                series.a[i, k - 1] / (w * k) * casadi.sin(w * k * t)
                - series.b[i, k - 1] / (w * k) * casadi.cos(w * k * t)
                for k in range(1, 6)
            )
            for i in range(6)
        ]
    )
    dq = casadi.jacobian(q, t)
    ddq = casadi.jacobian(dq, t)
    oracle = casadi.Function("f", [t], [q, dq, ddq, casadi.jacobian(ddq, t)])
    times = np.linspace(0.0, 10.0, 41)
    values = series.sample(times)
    for index, time in enumerate(times):
        for value, expected in zip(values, oracle(time), strict=True):
            # Both sides are sums of ten terms of order one to thirty in double precision.
            np.testing.assert_allclose(value[index], np.array(expected).ravel(), atol=1e-12)


def test_the_velocity_is_thesis_equation_79():
    """At t = 0 the velocity is the sum of the a and, a quarter period on, harmonics alternate as eq. 79 says."""
    series = FourierSeries(offsets=np.zeros(1), a=np.array([[1.0, 2.0]]), b=np.array([[3.0, 4.0]]), base_frequency=1.0)
    dq = series.sample([0.0, 0.25]).dq[:, 0]
    np.testing.assert_allclose(dq, [1 + 2, 3 - 2], atol=1e-15)


def test_the_basis_maps_coefficients_to_kinematics():
    """The basis matrices times one joint's row of coefficients give that joint's kinematics."""
    series = _series(3)
    t = np.linspace(0.0, 10.0, 7)
    for matrix, values in zip(series.basis(t), series.sample(t), strict=True):
        assert matrix.shape == (7, 11)
        np.testing.assert_allclose(matrix @ series.coefficients[2], values[:, 2], atol=1e-13)


def test_coefficients_round_trip():
    """A series built from another's coefficients is the same series."""
    series = _series(4)
    again = FourierSeries.from_coefficients(series.coefficients, 0.1)
    np.testing.assert_array_equal(again.coefficients, series.coefficients)
    assert again.harmonics == 5


@pytest.mark.slow
@settings(deadline=None)
@given(
    harmonics=st.integers(2, 12),
    base_frequency=st.floats(0.01, 10.0),
    seed=st.integers(0, 1000),
    periods=st.integers(1, 50),
)
def test_free_coefficients_give_rest_at_both_ends(harmonics, base_frequency, seed, periods):
    """Whatever the free coefficients, velocity and acceleration vanish at the start and after any number of periods."""
    free = np.random.default_rng(seed).normal(size=(2, 2 * harmonics - 1))
    series = FourierSeries.from_coefficients(free @ rest_basis(harmonics, base_frequency).T, base_frequency, periods)
    _, dq, ddq, _ = series.sample([0.0, series.duration])
    # The end is met to rounding of the time: duration * 1e-16 * jerk.
    w = 2 * np.pi * base_frequency
    assert np.abs(dq).max() < 1e-12
    assert np.abs(ddq).max() < 1e-12 * periods * w * harmonics**2 * 10


@pytest.mark.parametrize("harmonics", [1, 2, 5, 20])
def test_the_rest_basis_is_orthonormal_and_complete(harmonics):
    """It has two columns less than coefficients, orthonormal, and its complement is the two conditions."""
    basis = rest_basis(harmonics, 0.1)
    assert basis.shape == (2 * harmonics + 1, 2 * harmonics - 1)
    np.testing.assert_allclose(basis.T @ basis, np.eye(2 * harmonics - 1), atol=1e-14)
    _, dq, ddq, _ = fourier_basis(np.zeros(1), harmonics, 0.1)
    # Rounding of sums of up to twenty products.
    np.testing.assert_allclose(np.vstack([dq, ddq]) @ basis, 0.0, atol=1e-12)
    np.testing.assert_array_equal(basis[0], np.eye(2 * harmonics - 1)[0])


def test_periods_repeat_exactly():
    """The tenth period repeats the first to rounding of the time itself."""
    series = _series()
    t = np.arange(0.0, 10.0, 0.25)
    for first, tenth in zip(series.sample(t), series.sample(t + 90.0), strict=True):
        # 100 s carry 1.4e-14 s of rounding, times rates of order 100 per second.
        np.testing.assert_allclose(first, tenth, atol=1e-11)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"a": np.zeros((6, 4))}, "shapes"),
        ({"offsets": np.zeros(5)}, "shapes"),
        ({"a": np.zeros((6, 0)), "b": np.zeros((6, 0))}, "shapes"),
        ({"b": np.full((6, 5), np.nan)}, "finite"),
        ({"offsets": np.zeros((6, 1))}, "dimensions"),
        ({"base_frequency": 0.0}, "base frequency"),
        ({"periods": 0}, "periods"),
        ({"periods": 1.5}, "periods"),
    ],
)
def test_a_series_that_makes_no_sense_is_refused(change, message):
    """Shapes that do not fit, numbers that are not finite and frequencies that are not positive are errors."""
    good = {"offsets": np.zeros(6), "a": np.zeros((6, 5)), "b": np.zeros((6, 5)), "base_frequency": 0.1, "periods": 1}
    with pytest.raises(InputError, match=message):
        FourierSeries(**{**good, **change})


def test_rows_of_even_length_are_refused():
    """A row of coefficients is an offset and pairs: an even length is an error."""
    with pytest.raises(InputError, match="2N\\+1"):
        FourierSeries.from_coefficients(np.zeros((2, 4)), 0.1)
