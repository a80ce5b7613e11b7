"""Tests of the search for repeated motion."""

from __future__ import annotations

import numpy as np
import pytest

from estimation.preprocessing import find_cycle, resample
from tests.estimation.periodic_motion import STEP, periodic_motion


@pytest.mark.parametrize("period", [10.0, 7.3219, 3.14159])
def test_a_period_is_found_sharper_than_a_sample(period: float) -> None:
    """The period is found to a hundredth of a sample, also if it is not a multiple of the sample period."""
    q, _, _ = periodic_motion(period, 42.0)
    cycle = find_cycle(q, STEP)
    assert cycle is not None
    assert cycle.period == pytest.approx(period, abs=0.01 * STEP)
    assert cycle.count == int(42.0 / period)


def test_a_motion_that_never_returns_has_no_period() -> None:
    """Harmonics with a period longer than the log are no repetition."""
    q, _, _ = periodic_motion(100.0, 60.0)
    assert find_cycle(q, STEP) is None


def test_a_period_is_found_behind_an_approach() -> None:
    """An approach before the repetitions is left out of the cycle."""
    q, _, _ = periodic_motion(8.0, 32.0)
    approach = np.linspace(0, 1, 1000)[:, None] ** 2 * (q[0] - 0.5) + 0.5 * np.linspace(0, 1, 1000)[:, None] ** 2
    cycle = find_cycle(np.vstack([approach, q]), STEP)
    assert cycle is not None
    assert cycle.period == pytest.approx(8.0, abs=0.01 * STEP)
    assert cycle.start >= 900
    assert not cycle.whole


def test_a_period_is_found_at_uneven_times() -> None:
    """Uneven sampling and an encoder's noise leave the period of a whole log to a part in ten thousand."""
    rng = np.random.default_rng(0)
    t = np.cumsum(rng.uniform(0.5, 1.5, 4500) * STEP)
    q, _, _ = periodic_motion(2.0, 20.0)
    grid = resample(
        t,
        np.column_stack([np.interp(t, STEP * np.arange(len(q)), x) for x in q.T]) + 1e-4 * rng.normal(size=(len(t), 2)),
    )
    cycle = find_cycle(grid.q, grid.period)
    assert cycle is not None
    assert cycle.whole
    assert cycle.period == pytest.approx(2.0, rel=1e-4)


def test_what_does_not_repeat_has_no_period() -> None:
    """Tones without a common period, less than two periods, and a standing arm have none."""
    t = STEP * np.arange(5000)
    incommensurate = np.column_stack([np.sin(t) + np.sin(np.sqrt(2) * t), np.cos(np.sqrt(3) * t)])
    for q in (incommensurate, periodic_motion(2.0, 3.6)[0], np.full((5000, 2), 0.3)):
        assert find_cycle(q, STEP) is None
