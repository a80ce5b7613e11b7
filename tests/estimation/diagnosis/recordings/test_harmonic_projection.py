"""Tests of the projection of a periodic motion on its harmonics."""

from __future__ import annotations

import numpy as np
import pytest

from estimation.diagnosis.recordings.smoothed_motion import project_on_harmonics
from estimation.preprocessing import find_cycle
from tests.estimation.periodic_motion import STEP, periodic_motion


def test_the_projection_is_free_of_encoder_noise() -> None:
    """Acceleration errors of the projection are below a hundredth of those of finite differences."""
    q, dq, ddq = periodic_motion(10.0, 60.0)
    count = 2 * np.pi / 2**17
    counted = np.round(q / count) * count
    cycle = find_cycle(counted, STEP)
    assert cycle is not None
    (found_q, found_dq, found_ddq), known, _ = project_on_harmonics(counted, STEP, cycle)
    rows = slice(cycle.start, cycle.stop)
    # Rounding has a standard deviation of count / sqrt(12); the mean over six passes and few harmonics has far less.
    assert np.abs(found_q - q[rows]).max() < 0.3 * count
    assert np.sqrt(np.mean((found_dq - dq[rows]) ** 2)) < 1e-4
    differences = np.gradient(np.gradient(counted, STEP, axis=0), STEP, axis=0)
    assert np.std(found_ddq - ddq[rows]) < 0.01 * np.std(differences[rows] - ddq[rows])
    assert np.all(known >= 0.5)


@pytest.mark.parametrize("period", [10.0, 7.3219])
@pytest.mark.parametrize("rounded", [True, False])
def test_the_noise_of_the_mean_over_repetitions_is_reported(period: float, rounded: bool) -> None:
    """The noise density of the mean is estimated to a third, also if rounding is the same in all repetitions."""
    q, _, _ = periodic_motion(period, 8 * period)
    count = 2 * np.pi / 2**17
    noise = count * np.random.default_rng(1).standard_normal(q.shape)
    counted = np.round(q / count) * count if rounded else q + noise
    cycle = find_cycle(counted, STEP)
    assert cycle is not None
    _, _, density = project_on_harmonics(counted, STEP, cycle)
    # If repetitions begin between samples, each is rounded differently.
    repeats = 1 if rounded and period == 10.0 else cycle.count
    assert density == pytest.approx(2 * STEP * (counted - q).var(axis=0) / repeats, rel=1 / 3)
