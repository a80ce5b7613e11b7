"""Waypoints with a timing."""

from __future__ import annotations

import numpy as np
import pytest

from oed.experiments import retime
from oed.experiments.retiming import move_with_stops
from robots.common.errors import InfeasibleError, InputError
from tests.oed.campaigns.conftest import arm

POINTS = np.array([[0.0, 0.0], [0.5, 0.3], [1.0, -0.5], [0.2, -1.0]])


@pytest.mark.slow
@pytest.mark.parametrize("method", ["toppra", "ruckig"])
def test_all_waypoints_are_passed_within_the_limits(method: str) -> None:
    """The motion passes every waypoint in order, keeps all limits, and is at rest at both ends."""
    robot = arm()
    result = retime(robot, POINTS, method=method)
    motion = result.motion
    assert result.success
    rows = []
    for point in POINTS:
        away = np.abs(motion.q - point).max(axis=1)
        # The farthest that a sample can be from a point on the path: half a period at the highest speed.
        assert away.min() <= 2.0 * robot.period / 2 + 1e-9
        rows.append(int(away.argmin()))
    assert rows == sorted(rows)
    np.testing.assert_allclose(motion.dq[[0, -1]], 0.0, atol=1e-9)
    for values, limit in ((motion.dq, 2.0), (motion.ddq, 10.0), (np.diff(motion.ddq, axis=0) / robot.period, 200.0)):
        assert np.abs(values).max() <= limit * (1 + 1e-6)
    stops = move_with_stops(robot, POINTS)
    assert result.retimed.duration_before == pytest.approx(stops.duration)
    assert motion.duration <= stops.duration + 1e-9
    assert (method == "ruckig") == (motion.duration == pytest.approx(stops.duration))
    # Waypoints have no speed: nothing is said of a given timing.
    moves = "straight moves that stop at each waypoint"
    assert moves in result.summary()
    assert ("as long as" in result.summary()) == (method == "ruckig")
    assert "given" not in result.summary()


def test_wrong_waypoints() -> None:
    """One waypoint, another number of joints, a point outside the limits and no motion are one message each."""
    robot = arm()
    for points in (POINTS[:1], POINTS[:, :1], np.full((2, 2), np.nan)):
        with pytest.raises(InputError):
            retime(robot, points)
    for points in (5 * POINTS, np.zeros((3, 2))):
        with pytest.raises(InfeasibleError):
            retime(robot, points)
