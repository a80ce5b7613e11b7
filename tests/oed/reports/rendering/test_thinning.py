from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from oed.reports.rendering.thinning import thin_indices


@pytest.mark.slow
@given(st.integers(1, 5000), st.integers(6, 400), st.integers(0, 2**32 - 1), st.sampled_from([0.0, 0.3, 1.0]))
def test_extremes_and_ends_survive(count: int, points: int, seed: int, missing: float) -> None:
    """The smallest, the largest, the first and the last value stay, in order, within the number of points."""
    rng = np.random.default_rng(seed)
    y = rng.normal(size=count)
    y[rng.random(count) < missing] = np.nan
    kept = thin_indices(y, points)
    assert len(kept) <= max(points, min(count, points))
    assert np.all(np.diff(kept) > 0)
    assert kept[0] == 0
    assert kept[-1] == count - 1
    if not np.isnan(y).all():
        assert np.nanmax(y[kept]) == np.nanmax(y)
        assert np.nanmin(y[kept]) == np.nanmin(y)
    assert np.isnan(y[kept]).any() == np.isnan(y).any()


def test_single_spikes_survive_wherever_they_are() -> None:
    """Spikes of one sample in different stretches all stay, up and down."""
    y = np.zeros(15_000)
    spikes = np.arange(37, 15_000, 301)
    y[spikes] = np.where(np.arange(len(spikes)) % 2, 1.0, -1.0)
    assert np.isin(spikes, thin_indices(y, 1000)).all()


def test_short_series_are_left_alone() -> None:
    """A series of no more points than allowed stays as it is."""
    assert np.array_equal(thin_indices(np.zeros(100), 100), np.arange(100))
