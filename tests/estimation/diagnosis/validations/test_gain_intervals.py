"""Tests of the held-out gain and its interval."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

from estimation.diagnosis.validations.gain_intervals import HeldOutErrors, held_out_errors, model_columns
from estimation.regressions.parameter_priors import GaussianPrior


def _unseen(fall: float, seed: int) -> HeldOutErrors:
    rng = np.random.default_rng(seed)
    noise = lfilter([np.sqrt(1 - 0.95**2)], [1, -0.95], rng.standard_normal((6000, 1)), axis=0)
    extra = np.sqrt(2 * fall) * np.sin(np.arange(6000) / 37.0)[:, None]
    return HeldOutErrors(
        "a log",
        0.004 * np.arange(6000),
        0.004,
        10 * np.ones((6000, 1)),
        (noise + extra, noise + extra, noise),
        np.ones((6000, 1), dtype=bool),
    )


def test_nrmse_counts_only_rows_that_count() -> None:
    """Rows that do not count change neither the error nor the torque that it is divided by."""
    counts = np.ones((4, 1), dtype=bool)
    counts[3] = False
    errors = np.array([[1.0], [-1.0], [1.0], [100.0]])
    unseen = HeldOutErrors("a log", np.arange(4.0), 1.0, np.array([[2.0], [2.0], [2.0], [9.0]]), (errors,), counts)
    assert unseen.nrmse(0) == pytest.approx([0.5])


def test_the_interval_holds_the_fall_of_the_error() -> None:
    """In at least 15 of 20 logs with coloured errors, the 95 % interval of the gain contains the true one.

    With blocks of 24 s of data, eighteen are expected; fewer than 15 have a chance of about 1 in 400.
    """
    held = 0
    for seed in range(20):
        low, high = _unseen(0.5, seed).interval(1, 2, [0], np.random.default_rng(seed))
        held += low <= (np.sqrt(1.5) - 1.0) / 10 <= high
    assert held >= 15


def test_no_fall_has_an_interval_about_zero() -> None:
    """If the extension changes nothing, the interval is zero."""
    assert _unseen(0.0, 0).interval(1, 2, [0], np.random.default_rng(0)) == pytest.approx((0.0, 0.0), abs=1e-12)


def test_each_effect_is_left_out_once() -> None:
    """The compared models are the base model, the whole model without each effect, and the whole model."""
    chosen = model_columns(3, [np.zeros((1, 1, 2)), np.zeros((1, 1, 1))])
    assert [c.tolist() for c in chosen] == [[0, 1, 2], [0, 1, 2, 5], [0, 1, 2, 3, 4], [0, 1, 2, 3, 4, 5]]


def _of_sizes(errors: list[float], fitted: list[float] | None) -> HeldOutErrors:
    """Returns errors of given RMS on one joint whose torque has an RMS of one."""
    wave = np.sqrt(2) * np.sin(2 * np.pi * np.arange(1000) / 100)[:, None]
    seen = None if fitted is None else tuple(size * wave for size in fitted)
    counts = np.ones((1000, 1), dtype=bool)
    return HeldOutErrors("", 0.01 * np.arange(1000), 0.01, wave, tuple(size * wave for size in errors), counts, seen)


def test_what_is_kept_of_a_gain_is_its_share_of_the_fit_s() -> None:
    """The retained gain is the held-out gain over the gain in the fit's own rows; one without the latter."""
    errors = [0.30, 0.30, 0.28]
    assert _of_sizes(errors, [0.20, 0.20, 0.15]).retained_share(1, [0]) == pytest.approx(0.4)
    assert _of_sizes(errors, None).retained_share(1, [0]) == 1.0
    # A small gain in the fit gives no reference for the retained gain.
    assert _of_sizes(errors, [0.20, 0.20, 0.195]).retained_share(1, [0]) == 1.0


def test_a_model_goes_astray_by_its_error_where_it_was_fitted() -> None:
    """A joint is unreliable if its held-out error is four times the fit's and a fifth of the torque, not otherwise."""
    assert _of_sizes([0.3, 0.2], [0.06, 0.05]).is_unreliable(0)
    assert not _of_sizes([0.3, 0.1], [0.06, 0.05]).is_unreliable(0)
    assert not _of_sizes([0.3, 0.08], [0.06, 0.01]).is_unreliable(0)
    assert not _of_sizes([0.3, 0.2], None).is_unreliable(0)


class Rows(SimpleNamespace):
    """Replacement for a recording."""

    def __len__(self) -> int:
        return len(self.tau)


def _other_motion(seed: int, effect: float, there: float) -> HeldOutErrors:
    """Simulates a log with nearly collinear base columns, and a held-out log that separates them; noise of size one.

    The effect is slightly correlated with their difference, and has the factor `there` in the second log.
    """
    rng = np.random.default_rng(seed)
    rows, t = 2000, np.arange(2000) / 100

    def columns(apart: float) -> tuple[np.ndarray, np.ndarray]:
        first, second, x = np.sin(3 * t), np.sin(5 * t), np.sin(7 * t) + 0.02 * np.sin(5 * t)
        return np.stack([first, first + apart * second], axis=-1)[:, None], x[:, None, None]

    Y, X = columns(0.03)
    Z, W = columns(1.0)
    tau, unseen = (
        5.0 * base.sum(axis=2) + size * x[..., 0] + rng.standard_normal((rows, 1))
        for base, x, size in ((Y, X, effect), (Z, W, there * effect))
    )
    moving = np.zeros((rows, 1), dtype=bool)
    problem = SimpleNamespace(
        recording=Rows(sign_unknown=moving, tau=tau),
        baseline=SimpleNamespace(columns=Y),
        whitening=SimpleNamespace(scales=lambda count: np.ones((count, 1)), scale=np.ones(1), row_weight=1.0),
    )
    other = Rows(sign_unknown=moving, tau=unseen, t=t, step=0.01, runs=[slice(0, rows)], names=("other",))
    return held_out_errors(problem, [X], other, Z, [W], GaussianPrior(np.zeros((3, 3)), np.zeros(3)))  # type: ignore[arg-type]


@pytest.mark.slow
def test_a_true_effect_is_seldom_called_harmful_by_a_log_that_leaves_the_base_open() -> None:
    """At most 12 of 200 true effects are called harmful, though many have a larger held-out error.

    A chance of 2.5 % each is expected; 13 of 200 occur in one of 500 tests.
    """
    draws = [_other_motion(seed, 0.08, 1.0) for seed in range(200)]
    assert sum(unseen.surely_worse(1) for unseen in draws) <= 12
    assert sum(unseen.nrmse(2)[0] > unseen.nrmse(1)[0] for unseen in draws) > 60


@pytest.mark.parametrize("there", [-1.0, 0.0])
def test_an_effect_that_is_not_there_elsewhere_is_called_harmful(there: float) -> None:
    """An effect that is absent or reversed in the held-out log is called harmful."""
    draws = [_other_motion(seed, 0.5, there) for seed in range(20)]
    assert all(unseen.surely_worse(1) for unseen in draws)
