import numpy as np
import pytest

from oed.retiming import retime_with_stops
from robots.common.errors import InfeasibleError, InputError
from robots.signals import Motion

PERIOD = 0.004


def test_a_polyline_is_followed_with_a_stop_at_each_vertex(limits):
    """Every waypoint is met at rest, the legs between are straight, and the limits hold."""
    points = np.random.default_rng(0).uniform(-1.0, 1.0, size=(5, 6))
    result = retime_with_stops(points, limits, period=PERIOD)
    motion = result.motion
    assert result.stops == 3
    assert motion.period == pytest.approx(PERIOD)
    for point in points:
        row = int(np.abs(motion.q - point).max(axis=1).argmin())
        np.testing.assert_allclose(motion.q[row], point, atol=1e-12)
        np.testing.assert_allclose(motion.dq[row], 0.0, atol=1e-12)
    assert np.all(np.abs(motion.dq) <= limits.velocity * (1 + 1e-12))
    assert np.all(np.abs(motion.ddq) <= limits.acceleration * (1 + 1e-12))
    assert all(value.max() <= 1 + 1e-9 for value in result.usage.values())
    assert result.deviation == pytest.approx(0.0, abs=1e-12)


def test_a_motion_is_simplified_within_the_tolerance(limits):
    """A curve becomes a polyline that stays within the tolerance of it, with more stops the finer it is."""
    t = np.arange(1001) * PERIOD
    shape = 0.5 * (1 - np.cos(np.pi * t / 4))[:, None]
    q = np.hstack([shape, shape**2, np.sin(3 * shape), 0 * shape, 0 * shape, 0 * shape])
    motion = Motion(t, q, np.gradient(q, t, axis=0), np.zeros_like(q))
    coarse = retime_with_stops(motion, limits, period=PERIOD, tolerance=0.05)
    fine = retime_with_stops(motion, limits, period=PERIOD, tolerance=0.005)
    assert coarse.deviation <= 0.05
    assert fine.deviation <= 0.005
    assert fine.stops > coarse.stops > 0
    assert fine.duration_before == pytest.approx(4.0)


def test_what_makes_no_sense_is_refused(limits):
    """Paths that do not move, wrong shapes and tolerances that are not positive are errors."""
    with pytest.raises(InfeasibleError, match="no motion"):
        retime_with_stops(np.zeros((3, 6)), limits, period=PERIOD)
    with pytest.raises(InputError, match="shape"):
        retime_with_stops(np.zeros((3, 5)), limits, period=PERIOD)
    with pytest.raises(InputError, match="tolerance"):
        retime_with_stops(np.zeros((3, 6)), limits, period=PERIOD, tolerance=0.0)
