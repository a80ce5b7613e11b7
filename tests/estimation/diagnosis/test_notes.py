"""Specification of the notes on a diagnosis that need no robot."""

from __future__ import annotations

import numpy as np

from estimation.diagnosis.notes import LITTLE, WORSE, worse_joints


def test_joints_that_the_extension_makes_worse_are_told() -> None:
    """By more than a tenth of their error and a thousandth of the torque; never joints that nobody has seen."""
    before = np.array([0.050, 0.050, 0.0005, 0.050, np.nan])
    after = np.array([0.051, 0.074, 0.0012, 0.080, np.nan])
    (note,) = worse_joints(before, after)
    assert note == "The extended model errs more than the base model on joints 2 (5 -> 7.4 %), 4 (5 -> 8 %)."
    assert WORSE * 0.05 < 0.074
    assert 0.0005 + LITTLE > 0.0012
    assert worse_joints(before[:1], after[:1]) == []
    (one,) = worse_joints(before[1:2], after[1:2])
    assert "on joint 1 (5 -> 7.4 %)" in one
