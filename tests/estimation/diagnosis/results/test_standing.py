"""What the figures of a diagnosis allow to conclude."""

from __future__ import annotations

import numpy as np
import pytest

from estimation.diagnosis.experiment_plans.detection_limits import Limit
from estimation.diagnosis.results.standing import inaccurate_joints, standing_of, standing_text, standing_verdict


def limit(size):
    return Limit(
        effect="stribeck", joint=1, detectable=size, attributable=size, at_worst=size, toughest="", visible=1.0
    )


@pytest.mark.parametrize(
    ("verdict", "before", "after", "every", "expected"),
    [
        ("none", [0.03, 0.05], [0.03, 0.05], None, "sound"),
        ("none", [0.30, 0.05], [0.30, 0.05], None, "inaccurate"),
        ("none", [0.03, 0.05], [0.03, 0.05], [0.31, 0.05], "inaccurate"),
        ("named", [0.31, 0.31], [0.37, 0.37], None, "unconfirmed"),
        ("named", [0.08, 0.05], [0.03, 0.05], [np.nan, np.nan], "sound"),
        ("named", [0.60, 0.05], [0.33, 0.05], None, "inaccurate"),
        ("ambiguous", [0.30, 0.30], [0.30, 0.30], None, "sound"),  # The verdict itself asks for another experiment.
        ("unexplained", [0.30, 0.30], [0.30, 0.30], None, "sound"),
    ],
)
def test_errors_on_unseen_data_decide(verdict, before, after, every, expected):
    """Effects that do not reduce the error are unconfirmed; a large error that is left is stated."""
    assert standing_of(verdict, before, after, every) == expected
    assert bool(standing_text(verdict, before, after, every)) == (expected != "sound")


def test_a_log_that_can_show_little_says_so_first():
    """Where half of the effects would show above a fifth of the torque only, the text begins with that."""
    text = standing_text("none", [0.3], [0.3], limits=[limit(0.7), limit(0.8), limit(0.6)])
    assert text.startswith("These logs can show half of the effects only from 70 % of the torque on.")
    assert text.endswith("The error on unseen data, of the torque, is 30 % on joint 1.")
    verdict = standing_verdict("none", [0.3], [0.3], limits=[limit(0.7)])
    assert verdict.startswith("Do not use the model as it is: it errs by up to 30 % of the torque on unseen data")
    assert verdict.endswith(", and these logs can show little.")
    assert standing_text("none", [0.3], [0.3], limits=[limit(0.01)]).startswith("The error on unseen data, ")
    assert standing_text("none", [0.3], [0.3], limits=[limit(np.inf)]).startswith("These logs can show no effect.")


def test_each_joint_with_a_large_error_is_named():
    """The larger of both errors of a joint counts, and unknown ones do not."""
    np.testing.assert_array_equal(inaccurate_joints([0.1, 0.5, np.nan], [0.3, np.nan, np.nan]), [1, 2])
