"""Tests of the removal of encoder lines at constant speed."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from estimation.diagnosis.recordings.smoothed_motion import CRUISE, remove_encoder_lines

STEP, COUNT = 0.004, 5e-5


def _differentiated(q: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    dq = np.gradient(q, STEP, axis=0)
    return dq, np.gradient(dq, STEP, axis=0)


def test_lines_of_steps_are_taken_out_of_a_ramp() -> None:
    """At constant speed, acceleration errors of a counted position fall to a thousandth; the start is unchanged."""
    t = STEP * np.arange(5000)
    true = 0.1037 * np.where(t < 2.0, 0.25 * t**2, t - 1.0)
    q = (COUNT * np.round(true / COUNT))[:, None]
    dq, ddq = _differentiated(q)
    v, a = remove_encoder_lines(q, dq, ddq, np.array([COUNT]), STEP)
    ramp = (t > 2.1 + CRUISE) & (t < t[-1] - 1.1 * CRUISE)
    assert np.abs(v[ramp] - 0.1037).max() < 2 * COUNT / CRUISE
    assert np.abs(a[ramp]).max() <= 1.5 * COUNT / CRUISE**2 < 1e-3 * np.abs(ddq[ramp]).max()
    start = t < 2.0 - CRUISE
    np.testing.assert_array_equal(a[start], ddq[start])
    np.testing.assert_array_equal(v[start], dq[start])


def test_motion_that_bends_is_left_alone() -> None:
    """A slow sine, and a joint without encoder steps, keep their derivatives."""
    t = STEP * np.arange(5000)
    q = np.column_stack([np.sin(0.6 * t), 0.1 * t])
    dq, ddq = _differentiated(q)
    v, a = remove_encoder_lines(q, dq, ddq, np.array([COUNT, 0.0]), STEP)
    np.testing.assert_array_equal(v, dq)
    np.testing.assert_array_equal(a, ddq)


@pytest.mark.parametrize("rows", [10, 200])
def test_short_logs_are_left_alone(rows: int) -> None:
    """Logs that are too short for a line do not change."""
    q = 0.1 * STEP * np.arange(rows)[:, None]
    dq, ddq = _differentiated(q)
    for got, given in zip(remove_encoder_lines(q, dq, ddq, np.array([COUNT]), STEP), (dq, ddq), strict=True):
        np.testing.assert_array_equal(got, given)
