"""Specification of the step of a quantised column."""

from __future__ import annotations

import numpy as np
import pytest

from estimation.recordings.rows.columns import lattice_step


def test_a_value_off_the_grid_does_not_hide_the_step() -> None:
    """One of 2000 values is off the grid: its distance to the next is not the step."""
    values = np.random.default_rng(0).integers(0, 500, 2000) * 0.01
    assert lattice_step(values) == pytest.approx(0.01)
    values[7] += 1e-6
    assert lattice_step(values) == pytest.approx(0.01, rel=1e-4)
