import numpy as np
import pytest
from scipy.interpolate import PPoly

from oed.trajectories import PiecewisePolynomial
from robots.common.errors import InputError


@pytest.mark.parametrize("degree", [0, 1, 3, 5])
def test_pieces_agree_with_scipy(degree):
    """Pieces of any degree and their derivatives are those of scipy's piecewise polynomials."""
    rng = np.random.default_rng(degree)
    breakpoints = np.array([0.0, 0.3, 0.5, 1.2])
    coefficients = rng.normal(size=(3, 2, degree + 1))
    trajectory = PiecewisePolynomial(breakpoints=breakpoints, coefficients=coefficients)
    oracle = PPoly(np.moveaxis(coefficients[:, :, ::-1], -1, 0), breakpoints)
    t = np.linspace(0.0, 1.2, 50)
    for order, value in enumerate(trajectory.sample(t)):
        # Derivatives up to 60 c_5: rounding only.
        np.testing.assert_allclose(value, oracle(t, order), atol=1e-12)


def test_outside_its_duration_it_stays_at_its_ends():
    """Before the start and after the end the trajectory takes the values there."""
    trajectory = PiecewisePolynomial(breakpoints=np.array([0.0, 1.0]), coefficients=np.array([[[0.0, 1.0]]]))
    np.testing.assert_array_equal(trajectory.sample([-1.0, 2.0]).q[:, 0], [0.0, 1.0])


def test_a_hold_rests():
    """A hold keeps its pose with all derivatives zero."""
    hold = PiecewisePolynomial.hold([0.1, -0.2], 0.5)
    q, *rates = hold.sample([0.0, 0.2, 0.5])
    np.testing.assert_array_equal(q, [[0.1, -0.2]] * 3)
    assert all(not rate.any() for rate in rates)
    assert (hold.n, hold.duration) == (2, 0.5)


@pytest.mark.parametrize(
    ("breakpoints", "pieces"), [([0.0, 1.0], 2), ([0.0], 0), ([0.1, 1.0], 1), ([0.0, 1.0, 1.0], 2), ([0.0, np.nan], 1)]
)
def test_breakpoints_must_fit_and_increase_from_zero(breakpoints, pieces):
    """Breakpoints that do not fit the pieces or do not increase from zero are errors."""
    with pytest.raises(InputError):
        PiecewisePolynomial(breakpoints=np.array(breakpoints), coefficients=np.zeros((pieces, 1, 4)))
