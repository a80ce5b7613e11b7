"""Tests of standard errors by blocks of time, against the scatter of many fits."""

from __future__ import annotations

import numpy as np

from estimation.diagnosis.joint_fits.block_errors import widened_by_blocks

ROWS, FITS = 3000, 300


def _fits(misfit: float, seed: int) -> tuple[float, float, float]:
    """Fits three columns many times; the residual has white noise and a part that lasts for 30 rows.

    Returns:
        Scatter of the first value over the fits, and its mean standard errors without and with blocks.
    """
    rng = np.random.default_rng(seed)
    matrix = np.repeat(rng.normal(size=(ROWS // 30, 3)), 30, axis=0) + 0.2 * rng.normal(size=(ROWS, 3))
    covariance = np.linalg.inv(matrix.T @ matrix)
    values, wider = [], []
    for _ in range(FITS):
        lasting = np.repeat(rng.normal(size=ROWS // 30), 30)
        data = rng.normal(size=ROWS) + misfit * lasting
        found = covariance @ (matrix.T @ data)
        values.append(found[0])
        wider.append(widened_by_blocks(covariance, matrix, data - matrix @ found)[0, 0])
    return float(np.std(values)), float(np.sqrt(covariance[0, 0])), float(np.sqrt(np.mean(wider)))


def test_a_misfit_that_lasts_widens_the_errors_to_the_scatter() -> None:
    """A lasting part as large as the noise makes errors five times as large, and the blocks show it to 15 %."""
    scatter, white, blocks = _fits(1.0, 1)
    assert scatter > 4.0 * white
    assert abs(blocks / scatter - 1.0) < 0.15


def test_white_noise_hardly_widens_them() -> None:
    """The errors of white noise are never narrowed, and wider by a tenth only, by chance of the blocks' own scatter."""
    scatter, white, blocks = _fits(0.0, 2)
    assert abs(scatter / white - 1.0) < 0.15
    assert white <= blocks < 1.15 * white


def test_correlations_stay_and_nothing_is_no_error() -> None:
    """A column that is zero has no variance, and two values keep their correlation."""
    rng = np.random.default_rng(3)
    matrix = np.column_stack([rng.normal(size=(ROWS, 2)) @ np.array([[1.0, 0.6], [0.0, 0.8]]), np.zeros(ROWS)])
    covariance = np.zeros((3, 3))
    covariance[:2, :2] = np.linalg.inv(matrix[:, :2].T @ matrix[:, :2])
    wider = widened_by_blocks(covariance, matrix, np.repeat(rng.normal(size=ROWS // 30), 30))
    assert np.isfinite(wider).all()
    assert not wider[2].any()
    before, after = (c[0, 1] / np.sqrt(c[0, 0] * c[1, 1]) for c in (covariance, wider))
    np.testing.assert_allclose(after, before, rtol=1e-12)
