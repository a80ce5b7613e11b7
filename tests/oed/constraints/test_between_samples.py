import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from oed.constraints import (
    TrigonometricPolynomial,
    certified_extremes,
    exact_extremes,
    overshoot_factor,
    sampled_bounds,
    series_extremes,
    series_polynomials,
    tightened_bounds,
)
from robots.common.errors import InputError


def _random(seed: int, degree: int, n: int = 3) -> TrigonometricPolynomial:
    rng = np.random.default_rng(seed)
    return TrigonometricPolynomial(
        mean=rng.normal(size=n), cosine=rng.normal(size=(n, degree)), sine=rng.normal(size=(n, degree))
    )


def _dense(polynomial: TrigonometricPolynomial, count: int = 20001) -> np.ndarray:
    return polynomial(np.linspace(0.0, 2 * np.pi, count))


@pytest.mark.slow
@settings(deadline=None)
@given(seed=st.integers(0, 10_000), degree=st.integers(1, 8), extra=st.integers(1, 40), phase=st.floats(0.0, 1.0))
def test_bounds_from_samples_hold_between_them(seed, degree, extra, phase):
    """The range that samples guarantee contains the polynomial at twenty thousand points."""
    polynomial = _random(seed, degree)
    samples = 2 * degree + extra
    x = 2 * np.pi * (np.arange(samples) + phase) / samples
    low, high = sampled_bounds(polynomial(x).T, degree)
    dense = _dense(polynomial)
    assert np.all(dense.min(axis=1) >= low - 1e-12)
    assert np.all(dense.max(axis=1) <= high + 1e-12)


@pytest.mark.parametrize(("degree", "factor"), [(1, 2), (3, 2), (5, 4), (5, 20)])
def test_the_bound_is_attained_by_a_cosine_between_its_samples(degree, factor):
    """A cosine of the highest harmonic whose peak falls midway between two samples meets the bound with equality."""
    samples = 2 * degree * factor
    # Samples at the odd multiples of pi/M: the peak at 0 lies in the middle of two, and by symmetry so do all others.
    x = np.pi * (2 * np.arange(samples) + 1) / samples
    wave = TrigonometricPolynomial(mean=np.zeros(1), cosine=np.eye(degree)[[-1]], sine=np.zeros((1, degree)))
    _, high = sampled_bounds(wave(x).T, degree)
    # Rounding of a cosine and a division.
    assert high[0] == pytest.approx(1.0, abs=1e-14)


@pytest.mark.slow
@settings(deadline=None)
@given(seed=st.integers(0, 10_000), degree=st.integers(1, 8), samples=st.integers(1, 60))
def test_tightened_bounds_kept_at_samples_are_given_bounds_kept_always(seed, degree, samples):
    """A polynomial scaled to the tightened bounds at its samples keeps the given bounds everywhere."""
    count = 2 * degree + samples
    polynomial = _random(seed, degree)
    lower, upper = np.array([-1.0, 0.5, -3.0]), np.array([2.0, 0.8, -1.0])
    low, high = tightened_bounds(lower, upper, overshoot_factor(degree, count))
    values = polynomial(2 * np.pi * np.arange(count) / count)
    centre = (lower + upper) / 2
    scale = ((high - centre) / np.abs(values - polynomial.mean[:, None]).max(axis=1))[:, None]
    fitted = TrigonometricPolynomial(mean=centre, cosine=scale * polynomial.cosine, sine=scale * polynomial.sine)
    dense = _dense(fitted)
    assert np.all(dense >= lower[:, None] - 1e-12)
    assert np.all(dense <= upper[:, None] + 1e-12)
    np.testing.assert_allclose(low + high, 2 * centre, atol=1e-15)


def test_infinite_bounds_stay_and_one_sided_ones_are_refused():
    """No bound stays no bound; a bound on one side only cannot be guaranteed from samples and is an error."""
    low, high = tightened_bounds([-np.inf, -1.0], [np.inf, 1.0], overshoot_factor(5, 100))
    np.testing.assert_array_equal([low[0], high[0]], [-np.inf, np.inf])
    assert high[1] == pytest.approx(np.cos(np.pi * 5 / 100))
    with pytest.raises(InputError, match="joint 2"):
        tightened_bounds([-1.0, -np.inf], [1.0, 1.0], 0.9)


def test_too_few_samples_are_refused():
    """With 2N samples or fewer nothing can be said of a polynomial of degree N."""
    with pytest.raises(InputError, match="at least 11 samples"):
        overshoot_factor(5, 10)
    assert overshoot_factor(5, 11) > 0.0


@pytest.mark.slow
@settings(deadline=None)
@given(seed=st.integers(0, 10_000), degree=st.integers(1, 12))
def test_exact_extremes_are_those_of_a_dense_sampling(seed, degree):
    """The exact range holds all dense samples, exceeds them by their resolution only, and is attained where it says."""
    polynomial = _random(seed, degree)
    exact = exact_extremes(polynomial)
    dense = _dense(polynomial)
    # Between samples 3e-4 apart the parabola of an extreme rises by (1.6e-4)^2 / 2 max|p''|.
    bend = np.hypot(polynomial.cosine, polynomial.sine) @ np.arange(1, degree + 1) ** 2
    assert np.all(exact.highest >= dense.max(axis=1) - 1e-12)
    assert np.all(exact.highest <= dense.max(axis=1) + 1.3e-8 * bend + 1e-12)
    assert np.all(exact.lowest <= dense.min(axis=1) + 1e-12)
    assert np.all(exact.lowest >= dense.min(axis=1) - 1.3e-8 * bend - 1e-12)
    for row in range(3):
        assert polynomial(2 * np.pi * exact.highest_at[row])[row] == pytest.approx(exact.highest[row], abs=1e-11)
        assert polynomial(2 * np.pi * exact.lowest_at[row])[row] == pytest.approx(exact.lowest[row], abs=1e-11)


@pytest.mark.slow
@settings(deadline=None)
@given(seed=st.integers(0, 10_000), degree=st.integers(1, 12))
def test_the_taylor_certificate_encloses_the_exact_range_tightly(seed, degree):
    """Two independent proofs agree: the enclosure holds the exact range and is wider by a part in 100,000 at most."""
    polynomial = _random(seed, degree)
    exact, certified = exact_extremes(polynomial), certified_extremes(polynomial)
    bend = np.hypot(polynomial.cosine, polynomial.sine) @ np.arange(1, degree + 1) ** 2
    # (pi/4096)^2/2 = 2.9e-7, on either side of it.
    for gap in (certified.highest - exact.highest, exact.lowest - certified.lowest):
        assert np.all(gap >= -1e-12)
        assert np.all(gap <= 3e-7 * bend)


@pytest.mark.parametrize(
    ("cosine", "sine", "low", "high"),
    [
        ([0.0], [0.0], 0.0, 0.0),
        ([1.0, 0.0, 0.0], [0.0, 0.0, 0.0], -1.0, 1.0),
        ([0.0, 0.0, 1e-18], [2.0, 0.0, 0.0], -2.0, 2.0),
        # 4 cos x + cos 2x = 2 c^2 + 4 c - 1 has a fourfold flat minimum at pi.
        ([4.0, 1.0], [0.0, 0.0], -3.0, 5.0),
    ],
)
def test_degenerate_polynomials_have_exact_extremes(cosine, sine, low, high):
    """A constant, vanishing harmonics, rounding dust and a flat extreme make no trouble."""
    exact = exact_extremes(TrigonometricPolynomial(mean=np.zeros(1), cosine=np.array([cosine]), sine=np.array([sine])))
    assert exact.lowest[0] == pytest.approx(low, abs=1e-14)
    assert exact.highest[0] == pytest.approx(high, abs=1e-14)


def test_series_polynomials_are_thesis_equation_78_and_derivatives():
    """Each polynomial is w times the derivative of the one before, and the first is eq. 78."""
    rows = np.random.default_rng(0).normal(size=(4, 11))
    polynomials = series_polynomials(rows, 0.1)
    w = 2 * np.pi * 0.1
    x = np.linspace(0.0, 2 * np.pi, 9)
    order = np.arange(1, 6)[:, None]
    expected = (
        rows[:, :1] + (rows[:, 1:6] / w) @ (np.sin(order * x) / order) - (rows[:, 6:] / w) @ (np.cos(order * x) / order)
    )
    np.testing.assert_allclose(polynomials["q"](x), expected, atol=1e-13)
    for name, rate in (("q", "dq"), ("dq", "ddq"), ("ddq", "dddq")):
        # Rounding of ten terms of up to (3.1)^3.
        np.testing.assert_allclose(polynomials[rate](x), w * polynomials[name].derivative()(x), atol=1e-12)


def test_series_extremes_are_in_rad_and_seconds():
    """One harmonic of amplitude v in velocity has the extremes v/w, v, v w and v w^2."""
    extremes = series_extremes(np.array([[0.2, 0.0, 3.0]]), 0.5)
    w = np.pi
    assert extremes["q"].highest[0] == pytest.approx(0.2 + 3.0 / w)
    assert extremes["dq"].highest[0] == pytest.approx(3.0)
    assert extremes["ddq"].lowest[0] == pytest.approx(-3.0 * w)
    assert extremes["dddq"].highest[0] == pytest.approx(3.0 * w**2)
    assert extremes["dq"].highest_at[0] == pytest.approx(0.25)
