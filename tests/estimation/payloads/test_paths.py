"""Two logs of one path are laid over each other in time."""

from __future__ import annotations

import numpy as np
import pytest

from estimation.payloads.paths import match_paths

DURATION = 20.0


def motion(t: np.ndarray, seed: int = 0) -> np.ndarray:
    """Two joints on sums of sines without a common period, at rest before 0 and after the end."""
    rng = np.random.default_rng(seed)
    inside = np.clip(t, 0.0, DURATION)[:, None, None]
    rate = rng.uniform(0.5, 3.0, (4, 2))
    window = np.sin(np.pi * inside[..., 0] / DURATION) ** 2
    return window * (rng.normal(size=(4, 2)) * np.sin(rate * inside + rng.uniform(0, 6, (4, 2)))).sum(axis=1)


@pytest.mark.parametrize("delay", [0.0, 0.0371, -2.5, 4.0])
def test_a_log_that_started_later_is_shifted_back(delay: float) -> None:
    """The shift is found to a tenth of a sample, and pairs are rows of one place of the path."""
    t1, t2 = 100.0 + np.arange(0.0, 25.0, 0.004), np.arange(0.0, 25.0, 0.004)
    q1, q2 = motion(t1 - 103.0), motion(t2 - 3.0 - delay)
    match = match_paths(t1, q1, t2, q2)
    assert match.same
    assert match.shift == pytest.approx(delay - 100.0, abs=4e-4)
    # Half a sample at the largest speed.
    assert (
        np.abs(q1[match.first] - q2[match.second]).max() < 0.002 * np.abs(np.gradient(q1, 0.004, axis=0)).max() + 1e-3
    )
    assert len(np.unique(match.first)) == len(match.first)


def test_logs_of_other_periods_pair_each_row_of_the_sparser_one() -> None:
    """250 Hz and 100 Hz: every pair is within half a period of the denser log."""
    t1, t2 = np.arange(0.0, 25.0, 0.004), np.arange(0.0, 25.0, 0.01)
    for first, second in ((t1, t2), (t2, t1)):
        match = match_paths(first, motion(first - 2.0), second, motion(second - 2.0))
        assert match.same
        assert len(match.first) == pytest.approx(len(t2), abs=2)
        assert np.abs(first[match.first] + match.shift - second[match.second]).max() < 0.0021


def test_other_paths_are_reported_with_their_distance() -> None:
    """Another motion is not the same path; its distance is that of the positions."""
    t = np.arange(0.0, 25.0, 0.004)
    match = match_paths(t, motion(t - 2.0), t, motion(t - 2.0, seed=1))
    assert not match.same
    assert match.largest.max() > 0.5


def test_a_small_tracking_error_leaves_the_path_the_same() -> None:
    """5 mrad of sag under the load, and 1 mrad of noise."""
    t = np.arange(0.0, 25.0, 0.004)
    rng = np.random.default_rng(3)
    match = match_paths(t, motion(t - 2.0), t, motion(t - 2.0) + 0.005 + 0.001 * rng.normal(size=(len(t), 2)))
    assert match.same
    assert match.distance == pytest.approx(np.full(2, 0.0051), abs=4e-4)


def test_of_a_periodic_motion_the_longest_overlap_counts() -> None:
    """All whole periods fit; the logs as they are overlap most."""
    t = np.arange(0.0, 30.0, 0.004)
    q = np.column_stack([np.sin(2 * np.pi * t / 5), np.cos(2 * np.pi * t / 5)])
    match = match_paths(t, q, t, q)
    assert match.same
    assert match.shift == pytest.approx(0.0, abs=1e-4)
    assert len(match.first) == len(t)
