import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.signal import lfilter

from estimation.uncertainty import Part, covariance, sandwich, white_noise_covariance
from estimation.uncertainty.autoregressive import autocovariance, fit_noise
from robots.common.stretches import chunks
from tests.estimation.uncertainty.least_squares import JOINTS, WEIGHTS, coloured, fit

COLUMNS = 3


def regressor(rows, seed=0):
    """Slow columns, as those of a motion are, shared by both joints, and an offset of each."""
    t = 0.01 * np.arange(rows)
    rng = np.random.default_rng(seed)
    Y = np.zeros((rows, JOINTS, COLUMNS))
    Y[:, 0, 0] = np.sin(2 * np.pi * 0.5 * t + rng.uniform(0, 6))
    Y[:, 1, 0] = np.cos(2 * np.pi * 0.3 * t)
    Y[:, 0, 1] = 1.0
    Y[:, 1, 2] = np.sign(np.sin(2 * np.pi * 0.7 * t))
    return Y


def part(Y, mask, residual):
    return Part(len(Y), lambda start, stop: Y[start:stop], mask, residual)


@pytest.fixture
def problem():
    rng = np.random.default_rng(1)
    Y = regressor(700)
    mask = (rng.random((700, JOINTS)) < 0.95).astype(float)
    _, residual, inverse = fit(Y, coloured(700, rng), mask)
    return Y, mask, residual, inverse


def dense(Y, mask, residual, inverse):
    """(Y'WY)^-1 Y'W Gamma W Y (Y'WY)^-1 and the robust estimate, by matrices of all rows at once."""
    counts = mask.sum(axis=0)
    own = np.stack([autocovariance(residual[:, j], counts[j]) for j in range(JOINTS)])
    noise = fit_noise(residual, counts, own, sandwich.NOISE_ORDER_FACTOR)
    rows = len(Y)
    filters = []
    for a in noise.coefficients:
        response = lfilter([1.0], np.concatenate([[1.0], -a]), np.eye(1, rows)[0])
        filters.append(toeplitz(response, np.zeros(rows)))  # A^-1: noise = A^-1 innovations
    weighted = [(WEIGHTS[j] * mask[:, j])[:, None] * Y[:, j] for j in range(JOINTS)]
    gamma = [[filters[j] @ filters[k].T * noise.covariance[j, k] for k in range(JOINTS)] for j in range(JOINTS)]
    meat = sum(weighted[j].T @ gamma[j][k] @ weighted[k] for j in range(JOINTS) for k in range(JOINTS))
    innovations = noise.whitened(residual)
    scores = sum((filters[j].T @ weighted[j]) * innovations[:, j, None] for j in range(JOINTS))
    model, robust = inverse @ meat @ inverse, inverse @ scores.T @ scores @ inverse
    factor = np.sqrt(np.maximum(1.0, np.diag(robust) / np.diag(model)))
    return model * factor[:, None] * factor


def test_the_recursion_equals_the_dense_formula(problem, monkeypatch):
    """Filters over chunks give what Toeplitz matrices of all rows give."""
    monkeypatch.setattr(sandwich, "MOST_CORRECTED", 0)  # the plain formula, without the drawn correction
    Y, mask, residual, inverse = problem
    found = covariance([part(Y, mask, residual)], WEIGHTS, inverse)
    expected = dense(Y, mask, residual, inverse)
    # Two ways to sum the same 700 x 700 products.
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("chunk", [1, 33, 350, 699])
def test_chunks_do_not_matter(problem, monkeypatch, chunk):
    """Rows in pieces of any length give the same covariance, correction included."""
    Y, mask, residual, inverse = problem
    parts = [part(Y, mask, residual)]
    expected = covariance(parts, WEIGHTS, inverse, seed=3)
    white = white_noise_covariance(parts, WEIGHTS, inverse)
    monkeypatch.setattr(sandwich, "chunks", lambda rows: chunks(rows, chunk))
    np.testing.assert_allclose(covariance(parts, WEIGHTS, inverse, seed=3), expected, rtol=1e-9)
    np.testing.assert_allclose(white_noise_covariance(parts, WEIGHTS, inverse), white, rtol=1e-9)


def test_the_same_seed_gives_the_same_covariance(problem):
    """The drawn correction is reproducible, and matters little."""
    Y, mask, residual, inverse = problem
    parts = [part(Y, mask, residual)]
    first, again, other = (covariance(parts, WEIGHTS, inverse, seed=seed) for seed in (0, 0, 1))
    assert np.array_equal(first, again)
    np.testing.assert_allclose(np.diag(other), np.diag(first), rtol=0.3)


def test_logs_are_independent(monkeypatch):
    """Two logs that share a fit add their meats: noise does not run on from one log into the next."""
    monkeypatch.setattr(sandwich, "MOST_CORRECTED", 0)
    rng = np.random.default_rng(2)
    Y = [regressor(800, seed) for seed in (0, 1)]
    mask = np.ones((800, JOINTS))
    noise = [coloured(800, rng) for _ in Y]
    _, residual, inverse = fit(np.concatenate(Y), np.concatenate(noise), np.ones((1600, JOINTS)))
    apart = covariance([part(Y[k], mask, residual[800 * k : 800 * (k + 1)]) for k in (0, 1)], WEIGHTS, inverse)
    swapped = covariance([part(Y[k], mask, residual[800 * k : 800 * (k + 1)]) for k in (1, 0)], WEIGHTS, inverse)
    # Order changes the pooled autocovariance by the seam's products only: some 30 of 1600.
    np.testing.assert_allclose(swapped, apart, rtol=0.05, atol=0.05 * np.abs(apart).max())


@pytest.mark.slow
def test_the_stated_covariance_is_that_of_repeated_experiments():
    """Over 400 draws of coloured, correlated noise, the estimates scatter as the covariance says."""
    Y = regressor(2000)
    mask = np.ones((2000, JOINTS))
    rng = np.random.default_rng(4)
    estimates = []
    stated = np.zeros((COLUMNS, COLUMNS))
    white = np.zeros((COLUMNS, COLUMNS))
    for draw in range(400):
        values, residual, inverse = fit(Y, coloured(2000, rng), mask)
        estimates.append(values)
        if draw % 10 == 0:
            parts = [part(Y, mask, residual)]
            stated += covariance(parts, WEIGHTS, inverse, seed=draw) / 40
            white += white_noise_covariance(parts, WEIGHTS, inverse) / 40
    actual = np.cov(np.array(estimates).T)
    # A variance of 400 draws has a standard error of 7 %; three of them, and the larger of two estimates adds some.
    np.testing.assert_allclose(np.diag(stated), np.diag(actual), rtol=0.25)
    scale = np.sqrt(np.diag(actual))
    np.testing.assert_allclose(stated / scale[:, None] / scale, actual / scale[:, None] / scale, atol=0.25)
    # The textbook's formula is wrong by far for the offset, which lives at the noise's strongest frequency:
    # (1 + a) / (1 - a) = 19 for a = 0.9.
    assert actual[1, 1] / white[1, 1] == pytest.approx(19, rel=0.35)


def test_white_noise_gets_the_textbook_covariance():
    """With white noise and full weights both formulas give sigma^2 (Y'Y)^-1."""
    rng = np.random.default_rng(5)
    Y = regressor(4000)
    mask = np.ones((4000, JOINTS))
    noise = rng.normal(size=(4000, JOINTS))
    monochrome = np.linalg.inv(np.einsum("njp,nj,njq->pq", Y, mask, Y))
    residual = noise - Y @ (monochrome @ np.einsum("njp,nj->p", Y, noise))
    parts = [part(Y, mask, residual)]
    np.testing.assert_allclose(
        np.diag(white_noise_covariance(parts, np.ones(JOINTS), monochrome)), np.diag(monochrome), rtol=0.06
    )
    # The order's luck and the larger of two estimates: some per cent more.
    np.testing.assert_allclose(np.diag(covariance(parts, np.ones(JOINTS), monochrome)), np.diag(monochrome), rtol=0.2)


def test_louder_noise_where_it_counts_is_noticed():
    """Noise that is strong where a column is large gives that parameter the larger, robust standard error."""
    rng = np.random.default_rng(6)
    Y = regressor(4000)
    mask = np.ones((4000, JOINTS))
    noise = rng.normal(size=(4000, JOINTS)) * np.column_stack([1 + 3 * Y[:, 0, 0] ** 2, np.ones(4000)])
    _, residual, inverse = fit(Y, noise, mask)
    parts = [part(Y, mask, residual)]
    stated, white = covariance(parts, WEIGHTS, inverse), white_noise_covariance(parts, WEIGHTS, inverse)
    # True variance over the textbook's: E[y^2 s^2] / (E[y^2] E[s^2]) = 10.94 / 8.375 per unit of y^2 (s = 1 + 3 y^2).
    y2 = Y[:, 0, 0] ** 2
    s2 = (1 + 3 * y2) ** 2
    expected = np.mean(y2 * s2) / (np.mean(y2) * np.mean(s2))
    assert stated[0, 0] / white[0, 0] == pytest.approx(expected, rel=0.25)
    assert expected > 1.25


def test_a_direction_without_data_has_a_large_variance_and_no_negative_one():
    """Columns that are the same but for rounding leave their difference open: its errors are huge, all others hold."""
    rng = np.random.default_rng(3)
    Y = regressor(700)
    # A third and a fourth column that differ by what sixteen digits see, and one that no row has.
    twin = Y[:, :, :1] * (1 + 1e-15 * rng.standard_normal((700, JOINTS, 1)))
    wide = np.concatenate([Y, twin, np.zeros((700, JOINTS, 1))], axis=2)
    noise = coloured(700, rng)
    _, residual, inverse = fit(Y, noise, np.ones((700, JOINTS)))
    known = covariance([part(Y, np.ones((700, JOINTS)), residual)], WEIGHTS, inverse)
    weighted = (wide * WEIGHTS[None, :, None]).reshape(-1, wide.shape[2])
    gram = weighted.T @ wide.reshape(-1, wide.shape[2])
    scale = np.sqrt(np.where(np.diag(gram) > 0, np.diag(gram), 1.0))
    faint = np.linalg.inv(gram / scale[:, None] / scale + 1e-13 * np.eye(len(gram))) / scale[:, None] / scale
    full = covariance([part(wide, np.ones((700, JOINTS)), residual)], WEIGHTS, (faint + faint.T) / 2)
    errors = np.sqrt(np.diag(full))
    assert (np.linalg.eigvalsh(full / errors[:, None] / errors) > -1e-12).all()
    size = Y.shape[2]
    lost = [0, size, size + 1]
    assert (errors[lost] > 1e3 * np.sqrt(np.diag(known)).max()).all()
    kept = [k for k in range(size) if k != 0]
    np.testing.assert_allclose(errors[kept], np.sqrt(np.diag(known))[kept], rtol=1e-3)
