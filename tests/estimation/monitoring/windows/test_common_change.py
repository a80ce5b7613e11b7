"""What all joints share: one unknown or two, and joints that deviate."""

import numpy as np
import pytest

from estimation.monitoring.observations import common_change


def test_joint_that_deviates_is_ignored():
    """Five joints share -0.3, one has +0.2 beside it: the common change is that of the five."""
    d = np.array([-0.3, -0.31, -0.29, -0.1, -0.3, -0.3])
    (found,), covariance = common_change(d, np.full(6, 0.01**2), np.ones((6, 1)), np.array([0.5]), None)
    assert found == pytest.approx(-0.3, abs=0.01)
    (left,), _ = common_change(d, np.full(6, 0.01**2), np.ones((6, 1)), np.array([0.5]), 3)
    assert left == pytest.approx(-0.3, abs=0.003)
    assert covariance[0, 0] < 0.01**2


def test_two_unknowns_are_told_apart_beside_a_damage():
    """Two shapes over seven joints are found within 0.05 although one joint has 25 % more friction."""
    S = np.column_stack([np.ones(7), -np.array([0.5, 0.1, 0.4, 0.2, 0.3, 0.6, 0.15])])
    d = S @ [0.05, 0.8]
    d[2] += np.log(1.25)
    found, _ = common_change(d, np.full(7, 0.01**2), S, np.array([0.5, 0.5]), None)
    np.testing.assert_allclose(found, [0.05, 0.8], atol=0.05)


def test_without_prior_knowledge_nothing_is_taken_out():
    """Without a common unknown the change is zero."""
    found, covariance = common_change(np.ones(3), np.ones(3), np.ones((3, 2)), np.zeros(2), None)
    assert not found.any()
    assert not covariance.any()
