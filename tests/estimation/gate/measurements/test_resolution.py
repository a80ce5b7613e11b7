"""The step of a quantised column."""

from __future__ import annotations

import numpy as np
import pytest

from estimation.gate.measurements.resolution import lattice_step


def test_a_value_beside_the_lattice_does_not_hide_its_step() -> None:
    """One of 2000 values was rounded otherwise: its distance to the next is no step, nor a division by zero."""
    values = np.random.default_rng(0).integers(0, 500, 2000) * 0.01
    assert lattice_step(values) == pytest.approx(0.01)
    values[7] += 1e-6
    assert lattice_step(values) == pytest.approx(0.01, rel=1e-4)
