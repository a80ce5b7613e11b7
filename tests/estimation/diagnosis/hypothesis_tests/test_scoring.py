"""Tests of the score of a single column, and of the check which columns are not zero."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from estimation.diagnosis.calibration import MIN_VISIBLE_ENERGY
from estimation.diagnosis.hypothesis_tests.scoring import Score, visible_root
from estimation.diagnosis.noise_models.whitening import GLANCE, acting


@pytest.mark.parametrize("share", [0.9, 1.01 * MIN_VISIBLE_ENERGY, 0.99 * MIN_VISIBLE_ENERGY, 0.0])
def test_one_column_shows_as_it_does_beside_one_that_has_nothing_to_do_with_it(share: float) -> None:
    """One column has the same root as beside an orthogonal one; below the least visible energy it has none."""
    raw = np.array([7.0, 3.0])
    alone = visible_root(np.array([[share * raw[0]]]), raw[:1])
    both = visible_root(np.diag([share * raw[0], raw[1]]), raw)
    assert len(alone) == len(both) - 1
    np.testing.assert_allclose(np.sort(np.abs(both).sum(axis=0)), np.sort([np.abs(alone).sum(), raw[1] ** -0.5]))


def test_a_column_of_which_nothing_is_known_does_not_show() -> None:
    """A column with infinite energy before the projection does not show."""
    assert visible_root(np.ones((1, 1)), np.array([np.inf])).shape == (0, 1)


@pytest.mark.parametrize("bounds", [(-10.0, 10.0), (-10.0, 0.5), (2.0, 10.0), (0.0, np.inf), (-np.inf, 0.0)])
def test_one_coefficient_stops_at_its_bound(bounds: tuple[float, float]) -> None:
    """Gain and coefficient of one bounded column are those of scipy's bounded least squares."""
    rng = np.random.default_rng(0)
    x = rng.normal(size=200)
    y = 1.2 * x + rng.normal(size=200)
    gram = np.array([[x @ x]])
    score = Score(gram, np.array([x @ y]), gram[0], visible_root(gram, gram[0]), np.zeros((0, 1)))
    reported = lsq_linear(x[:, None], y, bounds=bounds)
    gain, coefficients = score.bounded(*(np.array([bound]) for bound in bounds))
    assert coefficients == pytest.approx(reported.x, rel=1e-6, abs=1e-6)
    assert gain == pytest.approx(max(y @ y - 2 * reported.cost, 0.0), rel=1e-6, abs=1e-4)


@pytest.mark.parametrize("rows", [0, 1, GLANCE, 10 * GLANCE + 7])
def test_a_column_that_acts_in_one_row_acts(rows: int) -> None:
    """A column with a single nonzero row is found, also between the rows that are sampled first."""
    columns = np.zeros((rows, 2, 3))
    for row in range(rows):
        columns[:] = 0.0
        columns[row, 1, row % 3] = -1e-300
        np.testing.assert_array_equal(acting(columns), columns.any(axis=0))
    assert acting(np.zeros((rows, 2))).tolist() == [False, False]
