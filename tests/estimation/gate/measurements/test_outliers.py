"""Outliers of single rows, and jumps that look like them for a moment."""

from __future__ import annotations

import numpy as np

from estimation.recordings.rows.outliers import outlier_rows


def test_a_jump_that_swings_back_a_little_is_no_outlier() -> None:
    """A log with a piece cut out jumps and then goes on, perhaps the other way; a garbled value returns."""
    t = 0.01 * np.arange(2000)
    q = np.sin(t)
    cut = np.concatenate([q[:900], q[1100:]])
    assert cut[900] - cut[899] < -0.5
    cut[901:] += 0.05
    assert len(outlier_rows(cut, 0.01, 0.0, noisy=False)) == 0
    garbled = q.copy()
    garbled[700] += 0.3
    assert outlier_rows(garbled, 0.01, 0.0, noisy=False).tolist() == [700]
