"""What a model misses in a motion that repeats counts once, not once a period."""

from __future__ import annotations

import numpy as np
import pytest

from estimation.uncertainty import Part, Place, Played, covariance, folded, repetitions, with_repetitions
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


def motion(rows: int, first: int = 0) -> np.ndarray:
    """Positions (rows, 2) behind the regressor, from a row on."""
    phase = 2 * np.pi * np.arange(first, first + rows) / ROWS
    return np.column_stack([np.sin(phase) + 0.4 * np.cos(3 * phase), 0.5 * np.sin(2 * phase + 0.3)])


def played(rows: int, period: float | None = STEP * ROWS, first: int = 0, **setup: object) -> Played:
    return Played(STEP * np.arange(rows), motion(rows, first), period, **setup)


def part(Y: np.ndarray, mask: np.ndarray, residual: np.ndarray) -> Part:
    return Part(len(Y), lambda start, stop: Y[start:stop], mask, residual)


def both(noise: np.ndarray, mask: np.ndarray, logs: int = 1) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The error of a fit, and its standard errors without and with the repetition; of one log, or of equal parts."""
    Y = regressor(len(noise))
    values, residual, inverse = fit(Y, noise, mask)
    pieces = zip(*(np.array_split(values, logs) for values in (Y, mask, residual)), strict=True)
    parts = [part(*piece) for piece in pieces]
    motions = [played(some.rows, STEP * ROWS if logs == 1 else None) for some in parts]
    plain = covariance(parts, WEIGHTS, inverse)
    repeated = with_repetitions(plain, parts, motions, WEIGHTS, inverse)
    return values, np.sqrt(np.diag(plain)), np.sqrt(np.diag(repeated))


@pytest.mark.slow
@pytest.mark.parametrize("logs", [1, PERIODS])
def test_what_repeats_counts_once(logs: int) -> None:
    """An error that is the same in every period, or in every log of a motion: standard errors that hold it.

    Over 40 draws the ratio of errors to standard errors has an RMS of 1; the bounds are four of its standard
    deviations of 6 % away, on top of what an autoregression of 400 rows misses of the density at rest.
    """
    rng, mask = np.random.default_rng(0), np.ones((ROWS * PERIODS, JOINTS))
    plain, repeated = [], []
    for _ in range(40):
        once = np.tile(coloured(ROWS, rng), (PERIODS, 1))
        error, small, large = both(once + 0.1 * rng.normal(size=once.shape), mask, logs)
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
    ((rows, places),) = repetitions([played(len(Y))])
    one = folded([part(Y, mask, residual)], rows, places)
    assert (one.rows, one.repeats) == (ROWS, 4)
    mean = np.concatenate([one.regressor(0, 150), one.regressor(150, ROWS)])
    score = one.repeats * np.einsum("tjp,tj,tj->p", mean, one.mask, one.residual)
    np.testing.assert_allclose(score, np.einsum("tjp,tj->p", Y, residual), rtol=1e-9, atol=1e-9)


def test_what_is_not_folded() -> None:
    """No period, hardly more than one, a short one, or rows off a grid: the log stays as it is."""
    some = part(regressor(900), np.ones((900, JOINTS)), np.ones((900, JOINTS)))
    uneven = np.where(np.arange(900) > 500, 0.02, 0.0)
    for log in (
        played(900, None),
        played(900, 7.0),
        played(900, 0.5),
        Played(STEP * np.arange(900) + uneven, motion(900), 4.0),
    ):
        ((rows, places),) = repetitions([log])
        assert (rows, places) == (900, [Place(0, 0)])
        assert folded([some], rows, places) is some


def test_logs_of_one_motion_are_found() -> None:
    """Logs that begin elsewhere in the motion, are shorter, or noisy, are one motion; those of another load are not."""
    rng = np.random.default_rng(3)
    rows = np.arange(1500)
    q = np.column_stack([np.sin(1e-2 * rows + 2e-6 * rows**2), np.cos(7e-3 * rows)])
    at = STEP * rows
    long = Played(at[:1100], q[:1100], None)
    late = Played(at[:700], q[250:950] + 1e-3 * rng.normal(size=(700, 2)), None)
    early = Played(at[:900], q[600:1500], None)
    other = Played(at[:900], q[:900, ::-1], None)
    tilted = Played(at[:800], q[:800], None, gravity=np.array([1.0, 0, -9.7]))
    loaded = Played(at[:850], q[:850], None, carries=True)
    found = repetitions([other, late, long, early, tilted, loaded])
    # The last log shares 500 rows with the longest one: more than half of its own.
    assert sorted((rows, sorted(places)) for rows, places in found) == [
        (800, [Place(4, 0)]),
        (850, [Place(5, 0)]),
        (900, [Place(0, 0)]),
        (1100, [Place(1, -250), Place(2, 0), Place(3, -600)]),
    ]


def test_a_fold_over_logs_keeps_the_score() -> None:
    """Periods of two logs; the second log begins within a period: the summed Y'We is that of both logs."""
    rng = np.random.default_rng(4)
    whole = regressor(ROWS * 4)
    sizes, firsts = (3 * ROWS + 57, 2 * ROWS - 31), (0, 130)
    parts, logs, score = [], [], 0.0
    for rows, first in zip(sizes, firsts, strict=True):
        Y = whole[first : first + rows]
        mask = (rng.random(Y.shape[:2]) < 0.8).astype(float)
        residual = rng.normal(size=mask.shape) * mask
        parts.append(part(Y, mask, residual))
        logs.append(played(rows, first=first))
        score = score + np.einsum("tjp,tj->p", Y, residual)
    ((rows, places),) = repetitions(logs)
    one = folded(parts, rows, places)
    assert rows == ROWS
    # Four periods begin in the first log; three touch the second.
    assert [place.log for place in places] == [0, 0, 0, 0, 1, 1, 1]
    mean = np.concatenate([one.regressor(0, 150), one.regressor(150, ROWS)])
    found = one.repeats * np.einsum("tjp,tj,tj->p", mean, one.mask, one.residual)
    np.testing.assert_allclose(found, score, rtol=1e-9, atol=1e-9)
