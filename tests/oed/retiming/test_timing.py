import dataclasses

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from oed.retiming.timing import TimeLaw, kinematics


def _law(window: float = 0.1, stretch: float = 1.0) -> TimeLaw:
    s = np.linspace(0.0, 2.0, 201)
    speed = np.minimum(np.minimum(np.sqrt(8.0 * s), np.sqrt(8.0 * (2.0 - s))), 1.5)
    return dataclasses.replace(TimeLaw.from_grid(s, speed, window), stretch=stretch)


def test_the_law_covers_the_path_from_rest_to_rest():
    """It starts at 0 and ends at the length, without speed or acceleration, monotonically."""
    law = _law()
    s, ds, dds = law.sample(np.linspace(0.0, law.duration, 1001))
    np.testing.assert_allclose([s[0], s[-1]], [0.0, 2.0], atol=1e-12)
    np.testing.assert_allclose([ds[0], ds[-1], dds[0], dds[-1]], 0.0, atol=1e-10)
    assert np.all(ds >= -1e-12)


def test_averaging_lasts_one_window_longer_and_keeps_the_ranges():
    """Speed and acceleration stay within those of the law, and the duration grows by the window."""
    law = _law()
    # The trapezoid itself: d/v + v/a with d = 2, v = 1.5, a = 4; the grid rounds its two corners.
    assert law.duration == pytest.approx(2.0 / 1.5 + 1.5 / 4.0 + 0.1, abs=2e-3)
    _, ds, dds = law.sample(np.linspace(0.0, law.duration, 5001))
    assert ds.max() <= 1.5 + 1e-12
    assert np.abs(dds).max() <= 4.0 + 1e-9


@pytest.mark.parametrize("stretch", [1.0, 1.7])
def test_rates_are_derivatives(stretch):
    """Position and speed grow by the integrals of speed and acceleration, at any stretch."""
    law = _law(stretch=stretch)
    t = np.linspace(0.0, law.duration, 20001)
    s, ds, dds = law.sample(t)
    step = t[1] - t[0]
    for value, rate in ((s, ds), (ds, dds)):
        total = np.concatenate([[0.0], np.cumsum((rate[1:] + rate[:-1]) / 2 * step)])
        # Trapezoidal rule: step^2 / 12 times the total variation of the next rate, here below 400.
        np.testing.assert_allclose(value - value[0], total, atol=step**2 * 400)


def test_motion_along_a_path_obeys_the_chain_rule():
    """Along q = (s, s^2) the velocity is (1, 2 s) ds and the acceleration (0, 2) ds^2 + (1, 2 s) dds."""
    knots = np.linspace(0.0, 2.0, 5)
    spline = CubicSpline(knots, np.column_stack([knots, knots**2]))
    s, ds, dds = np.array([0.3, 1.1]), np.array([2.0, -1.0]), np.array([0.5, 3.0])
    q, dq, ddq = kinematics(spline, s, ds, dds)
    np.testing.assert_allclose(q, np.column_stack([s, s**2]), atol=1e-14)
    np.testing.assert_allclose(dq, np.column_stack([ds, 2 * s * ds]), atol=1e-13)
    np.testing.assert_allclose(ddq, np.column_stack([dds, 2 * ds**2 + 2 * s * dds]), atol=1e-12)
