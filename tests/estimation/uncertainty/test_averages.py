import numpy as np
import pytest

from estimation.uncertainty import Part, covariance, sandwich
from estimation.uncertainty.averages import Averages
from tests.estimation.uncertainty.least_squares import JOINTS, WEIGHTS, coloured, fit


def regressor(rows, fastest=0.7):
    """Columns up to `fastest` Hz at 100 Hz, shared by both joints or a joint's own, an offset and a sign of motion."""
    t = 0.01 * np.arange(rows)
    Y = np.zeros((rows, JOINTS, 4))
    Y[:, 0, 0] = np.sin(2 * np.pi * 0.5 * t)
    Y[:, 1, 0] = np.cos(2 * np.pi * 0.3 * t)
    Y[:, 0, 1] = 1.0
    Y[:, 1, 2] = np.sign(np.sin(2 * np.pi * 0.7 * t))
    Y[:, 0, 3] = np.cos(2 * np.pi * fastest * t + 0.3)
    return Y


def fitted(Y, noise, mask):
    values, residual, inverse = fit(Y, noise, mask)
    return values, Part(len(Y), lambda i, k: Y[i:k], mask, residual), inverse


def averages(Y, mask, residual, size, chunk):
    return Averages.of(Part(len(Y), lambda i, k: Y[i:k], mask, residual).columns, mask, residual, size, chunk)


@pytest.mark.parametrize("chunk", [4, 50, 1000])
def test_groups_are_summed_row_by_row(monkeypatch, chunk):
    """Sums, means and deviations equal those of a loop over the rows that count, in pieces of any length."""
    monkeypatch.setattr("estimation.uncertainty.averages.DEVIATION_STRIDE", 1)
    rng, size = np.random.default_rng(0), 4
    Y, mask = regressor(203), (rng.random((203, JOINTS)) < 0.8).astype(float)
    residual = rng.normal(size=(203, JOINTS)) * mask
    found = averages(Y, mask, residual, size, chunk)
    assert found.rows == 50
    for j in range(JOINTS):
        within, spread, freedom = np.zeros((4, 4)), 0.0, 0
        for g in range(found.rows):
            rows = [i for i in range(g * size, (g + 1) * size) if mask[i, j]]
            assert found.mask[g, j] == len(rows) / size
            if not rows:
                continue
            np.testing.assert_allclose(found.sums[j][g], Y[rows, j].sum(axis=0), atol=1e-12)
            np.testing.assert_allclose(found.residual[g, j], residual[rows, j].mean(), atol=1e-12)
            deviation = Y[rows, j] - Y[rows, j].mean(axis=0)
            within += deviation.T @ deviation
            spread += float(np.sum((residual[rows, j] - residual[rows, j].mean()) ** 2))
            freedom += len(rows) - 1
        np.testing.assert_allclose(found.within[j], within, atol=1e-10)
        np.testing.assert_allclose(found.variance[j], spread / freedom, rtol=1e-10)


def test_columns_times_the_mask_are_the_sums():
    """What the sandwich multiplies by the mask comes out as each group's sum."""
    rng = np.random.default_rng(1)
    Y, mask = regressor(500), (rng.random((500, JOINTS)) < 0.5).astype(float)
    found = averages(Y, mask, rng.normal(size=(500, JOINTS)) * mask, 5, 100)
    for joint, (columns, _) in enumerate(found.columns(10, 40)):
        np.testing.assert_allclose(columns * found.mask[10:40, joint, None], found.sums[joint][10:40], atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("fastest", [0.7, 8.0])
def test_white_noise_keeps_the_textbook_covariance(monkeypatch, fastest):
    """Of white noise, five rows averaged give sigma^2 (Y'Y)^-1, also of columns that turn within a few groups."""
    monkeypatch.setattr(sandwich, "MOST_CORRECTED", 0)
    Y, mask = regressor(20_000, fastest), np.ones((20_000, JOINTS))
    inverse = np.linalg.inv(np.einsum("njp,njq->pq", Y, Y))
    errors = []
    for seed in range(16):
        noise = np.random.default_rng(seed).normal(size=mask.shape)
        residual = noise - Y @ (inverse @ np.einsum("njp,nj->p", Y, noise))
        part = Part(len(Y), lambda i, k: Y[i:k], mask, residual)
        errors.append(np.sqrt(np.diag(covariance([part], np.ones(JOINTS), inverse, averaged=5))))
    # Each knows a density at rest, from 4000 averages, to some six per cent; their mean to a quarter of that.
    np.testing.assert_allclose(np.mean(errors, axis=0), np.sqrt(np.diag(inverse)), rtol=0.04)


@pytest.mark.slow
def test_averages_state_the_covariance_of_repeated_experiments(monkeypatch):
    """Over 400 draws of coloured, correlated noise, with rows that do not count, estimates scatter as stated."""
    monkeypatch.setattr(sandwich, "MOST_CORRECTED", 0)
    rng = np.random.default_rng(4)
    Y, mask = regressor(4000), (rng.random((4000, JOINTS)) < 0.97).astype(float)
    estimates, stated = [], np.zeros((4, 4))
    for draw in range(400):
        values, part, inverse = fitted(Y, coloured(4000, rng), mask)
        estimates.append(values)
        if draw % 10 == 0:
            stated += covariance([part], WEIGHTS, inverse, averaged=5) / 40
    actual = np.cov(np.array(estimates).T)
    # A variance of 400 draws has a standard error of 7 %; three of them, and the larger of two estimates adds some.
    np.testing.assert_allclose(np.diag(stated), np.diag(actual), rtol=0.25)


def test_averages_agree_with_all_rows(monkeypatch):
    """Of one long coloured residual both say the same standard errors."""
    monkeypatch.setattr(sandwich, "MOST_CORRECTED", 0)
    rng = np.random.default_rng(6)
    mask = (rng.random((40_000, JOINTS)) < 0.98).astype(float)
    _, part, inverse = fitted(regressor(40_000), coloured(40_000, rng), mask)
    errors = [np.sqrt(np.diag(covariance([part], WEIGHTS, inverse, averaged=size))) for size in (1, 5)]
    # Two autoregressive models of one residual, of other orders and steps: each knows its density to five per cent.
    np.testing.assert_allclose(errors[1], errors[0], rtol=0.15)


def test_short_logs_are_not_averaged():
    """Where the fit eats noticeably of the noise, all rows count as before."""
    rng = np.random.default_rng(7)
    _, part, inverse = fitted(regressor(2000), coloured(2000, rng), np.ones((2000, JOINTS)))
    found = covariance([part], WEIGHTS, inverse, averaged=5)
    assert np.array_equal(found, covariance([part], WEIGHTS, inverse))


def test_parts_shorter_than_a_group_are_left_out(monkeypatch):
    """A scrap of a log of fewer rows than a group changes nothing."""
    monkeypatch.setattr(sandwich, "MOST_CORRECTED", 0)
    rng = np.random.default_rng(8)
    Y = regressor(5003)
    _, part, inverse = fitted(Y, coloured(5003, rng), np.ones((5003, JOINTS)))
    parts = [
        Part(stop - start, lambda i, k, first=start: Y[first + i : first + k], part.mask[start:stop], residual)
        for start, stop in ((0, 5000), (5000, 5003))
        for residual in [part.residual[start:stop]]
    ]
    found = covariance(parts, WEIGHTS, inverse, averaged=5)
    assert np.array_equal(found, covariance(parts[:1], WEIGHTS, inverse, averaged=5))


@pytest.mark.parametrize("share", [1.0, 0.9, 0.0])
def test_sums_of_groups_may_be_given(share):
    """Sums that somebody else has made of the rows as they count give what sums of the rows give."""
    rng, size = np.random.default_rng(6), 5
    Y, mask = regressor(1203), (rng.random((1203, JOINTS)) < share).astype(float)
    residual = rng.normal(size=(1203, JOINTS)) * mask
    asked = []

    def sums(start, stop, size):
        asked.append(start)
        counted = Y[start:stop] * mask[start:stop, :, None]
        return list(counted.reshape(-1, size, JOINTS, 4).sum(axis=1).transpose(1, 0, 2))

    part = Part(len(Y), lambda i, k: Y[i:k], mask, residual)
    plain = Averages.of(part.columns, mask, residual, size, 100)
    given = Averages.of(part.columns, mask, residual, size, 100, sums)
    assert len(asked) > 5
    for first, second in zip(plain.sums, given.sums, strict=True):
        np.testing.assert_allclose(second, first, atol=1e-12)
    for first, second in zip(plain.within, given.within, strict=True):
        np.testing.assert_array_equal(second, first)
