"""Trajectories as points of the simple_message protocol."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from oed.exports.simple_message import FullPoint, Point, trajectory_points
from robots.common.errors import InputError
from robots.signals import Motion


def motion(n: int = 2) -> Motion:
    """One second of cosines that begins at 5 s."""
    t = 5.0 + 0.1 * np.arange(11)
    q = np.outer(np.cos(t), np.arange(1, n + 1))
    dq = np.outer(-np.sin(t), np.arange(1, n + 1))
    return Motion(t, q, dq, -q)


def test_full_points_are_the_samples() -> None:
    """Full points carry time since the start, positions, velocities and accelerations of every sample, in order."""
    points = list(trajectory_points(motion()))
    assert [point.sequence for point in points] == list(range(11))
    assert all(isinstance(point, FullPoint) for point in points)
    np.testing.assert_allclose([point.time for point in points], 0.1 * np.arange(11), atol=1e-12)
    np.testing.assert_array_equal([point.positions for point in points], motion().q)
    np.testing.assert_array_equal([point.velocities for point in points], motion().dq)
    np.testing.assert_array_equal([point.accelerations for point in points], motion().ddq)


def test_short_points_have_the_share_of_the_critical_joint() -> None:
    """Short points state the velocity of the joint nearest to its limit as a share of it, and the move's duration."""
    limits = SimpleNamespace(velocity=np.array([4.0, 2.0]))
    points = list(trajectory_points(motion(), limits, kind="short"))  # type: ignore[arg-type]
    assert all(isinstance(point, Point) for point in points)
    np.testing.assert_allclose([p.velocity for p in points], np.minimum(np.abs(np.sin(motion().t)), 1.0))
    np.testing.assert_allclose([p.duration for p in points], [0.0, *[0.1] * 10], atol=1e-12)


@pytest.mark.parametrize(
    ("joints", "kind", "problem"), [(11, "full", "11 joints"), (2, "short", "velocity limits"), (2, "long", "long")]
)
def test_wrong_trajectories(joints: int, kind, problem: str) -> None:
    """Too many joints, the short type without limits, and another type are refused."""
    with pytest.raises(InputError, match=problem):
        list(trajectory_points(motion(joints), kind=kind))
