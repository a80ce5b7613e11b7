"""What a model misses in a motion that repeats counts once, not once a period."""

from __future__ import annotations

import numpy as np
import pytest

from estimation.uncertainty import Part, covariance, folded, repeated_covariance
from tests.estimation.uncertainty.least_squares import JOINTS, WEIGHTS, coloured, fit

STEP, ROWS, PERIODS = 0.01, 400, 6


def regressor(rows: int = ROWS * PERIODS) -> np.ndarray:
    """Columns that repeat every `ROWS` rows."""
    phase = 2 * np.pi * np.arange(rows) / ROWS
    Y = np.zeros((rows, JOINTS, 3))
    Y[:, 0, 0], Y[:, 1, 0] = np.sin(phase), np.cos(2 * phase)
    Y[:, 0, 1] = 1.0
    Y[:, 1, 2] = np.sign(np.sin(3 * phase + 0.1))
    return Y


def part(Y: np.ndarray, mask: np.ndarray, residual: np.ndarray) -> Part:
    return Part(len(Y), lambda start, stop: Y[start:stop], mask, residual)


def both(noise: np.ndarray, mask: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The error of a fit, and its standard errors without and with the repetition."""
    Y = regressor(len(noise))
    values, residual, inverse = fit(Y, noise, mask)
    parts, t = [part(Y, mask, residual)], STEP * np.arange(len(Y))
    plain = covariance(parts, WEIGHTS, inverse)
    repeated = repeated_covariance(parts, [t], [STEP * ROWS], WEIGHTS, inverse)
    return values, np.sqrt(np.diag(plain)), np.sqrt(np.diag(repeated))


@pytest.mark.slow
def test_what_repeats_counts_once() -> None:
    """An error that is the same in every period: standard errors that hold it, where the plain ones are too small.

    Over 40 draws the ratio of errors to standard errors has an RMS of 1; the bounds are four of its standard
    deviations of 6 % away, on top of what an autoregression of 400 rows misses of the density at rest.
    """
    rng, mask = np.random.default_rng(0), np.ones((ROWS * PERIODS, JOINTS))
    plain, repeated = [], []
    for _ in range(40):
        once = np.tile(coloured(ROWS, rng), (PERIODS, 1))
        error, small, large = both(once + 0.1 * rng.normal(size=once.shape), mask)
        plain.append(error / small)
        repeated.append(error / large)
    assert np.sqrt(np.mean(np.square(plain))) > 1.7
    assert 0.6 < np.sqrt(np.mean(np.square(repeated))) < 1.4


@pytest.mark.slow
def test_noise_alone_keeps_its_errors() -> None:
    """Of noise that does not repeat, standard errors grow by what a shorter average scatters, a fifth at most."""
    rng = np.random.default_rng(1)
    mask = (rng.random((ROWS * PERIODS + 130, JOINTS)) < 0.95).astype(float)
    found = [both(coloured(len(mask), rng), mask)[1:] for _ in range(10)]
    assert all((large >= small * (1 - 1e-12)).all() for small, large in found)
    assert np.mean([large / small for small, large in found]) < 1.2


def test_the_score_of_a_fold_is_that_of_the_log() -> None:
    """Y'We summed over the phases is Y'We summed over the rows, with an incomplete last period and masked rows."""
    rng = np.random.default_rng(2)
    Y = regressor(ROWS * 3 + 57)
    mask = (rng.random(Y.shape[:2]) < 0.8).astype(float)
    residual = rng.normal(size=mask.shape) * mask
    one = folded(part(Y, mask, residual), STEP * np.arange(len(Y)), STEP * ROWS)
    assert (one.rows, one.repeats) == (ROWS, 4)
    mean = np.concatenate([one.regressor(0, 150), one.regressor(150, ROWS)])
    score = one.repeats * np.einsum("tjp,tj,tj->p", mean, one.mask, one.residual)
    np.testing.assert_allclose(score, np.einsum("tjp,tj->p", Y, residual), rtol=1e-9, atol=1e-9)


def test_what_is_not_folded() -> None:
    """No period, hardly more than one, a short one, or rows off a grid: the log stays as it is."""
    Y = regressor(900)
    some, t = part(Y, np.ones((900, JOINTS)), np.ones((900, JOINTS))), STEP * np.arange(900)
    uneven = np.where(np.arange(900) > 500, t + 0.02, t)
    for times, period in ((t, None), (t, 7.0), (t, 0.5), (uneven, 4.0)):
        assert folded(some, times, period) is some
