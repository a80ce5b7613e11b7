"""Specification of what a finding calls determined."""

from __future__ import annotations

import numpy as np
import pytest

from estimation.diagnosis.wording import _roughly
from robots.terms.effects import EFFECTS


@pytest.mark.parametrize(
    ("effect", "shape", "value", "interval", "roughly"),
    [
        ("thermal_friction", 0, 113.0, (80.0, 161.0), True),
        ("thermal_friction", 0, 113.0, (95.0, 134.0), False),
        ("load_dependent_friction", 0, 0.0, (-0.2, 0.2), True),
        ("load_dependent_friction", 0, 0.8, (0.7, 0.9), False),
        ("friction_step", 0, 2000.0, (1999.9, 2000.1), False),
        ("friction_step", 0, 2.0, (1.7, 2.3), True),
        # A dead centre is a place: a fifth of one near zero is nothing.
        ("spring", 1, 0.01, (-0.1, 0.1), False),
        # Of what the data say nothing, the error itself tells.
        ("thermal_friction", 0, 113.0, (-np.inf, np.inf), False),
    ],
)
def test_a_fifth_of_a_value_or_of_a_second(
    effect: str, shape: int, value: float, interval: tuple[float, float], roughly: bool
) -> None:
    """A nonlinear parameter is known roughly where its interval is wider, a moment by the clock."""
    assert _roughly(EFFECTS[effect].shapes[shape], value, interval) is roughly
