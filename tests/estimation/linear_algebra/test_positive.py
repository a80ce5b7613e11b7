import numpy as np
import pytest

from estimation.linear_algebra.positive import solve_positive


@pytest.mark.parametrize("columns", [(), (3,)])
def test_it_solves_as_numpy_does(columns):
    """One right side or several, and neither argument is written to."""
    rng = np.random.default_rng(0)
    root, right = rng.normal(size=(9, 6)), rng.normal(size=(6, *columns))
    matrix = root.T @ root
    before = matrix.copy(), right.copy()
    # A condition of some hundred leaves thirteen digits.
    np.testing.assert_allclose(solve_positive(matrix, right), np.linalg.solve(matrix, right), rtol=1e-10)
    assert np.array_equal(matrix, before[0])
    assert np.array_equal(right, before[1])


@pytest.mark.parametrize(("spoil", "said"), [(-1.0, "order 3 is not positive definite"), (np.nan, "not finite|order")])
def test_what_is_not_positive_definite_is_refused(spoil, said):
    """A negative number on the diagonal raises, and says where; so does what is not a number."""
    matrix = np.eye(4)
    matrix[2, 2] = spoil
    with pytest.raises(np.linalg.LinAlgError, match=said):
        solve_positive(matrix, np.ones(4))
