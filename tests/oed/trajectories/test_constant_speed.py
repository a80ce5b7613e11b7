import numpy as np
import pytest

from oed.trajectories import constant_speed_sweep, spaced_speeds
from robots.common.errors import InputError

PERIOD = 0.004


def _khz(trajectory):
    return trajectory.sample(np.arange(0.0, trajectory.duration + 5e-4, 1e-3))


def test_every_speed_crosses_the_whole_range_both_ways(limits):
    """From the slowest to the fastest, each speed is driven up and down over the range, which is met and not passed."""
    sweep = constant_speed_sweep(limits, 1, np.zeros(3), speeds=[4.0, 0.5, 2.0], period=PERIOD)
    np.testing.assert_allclose([p.speed for p in sweep.plateaus[::2]], [0.5, 2.0, 4.0], rtol=1e-8)
    assert [p.direction for p in sweep.plateaus] == [1, -1] * 3
    q, dq, ddq, dddq = (values[:, 0] for values in _khz(sweep))
    assert 2.9 - 0.0058 <= q.max() <= 2.9
    assert -2.9 <= q.min() <= -2.9 + 0.0058
    for values, bound in ((dq, 4.0), (ddq, 16.0), (dddq, 320.0)):
        assert 0.999 * bound <= np.abs(values).max() <= bound
    for plateau in sweep.plateaus:
        crossed = plateau.speed * plateau.duration
        ramps = 5.8 - crossed
        # Two ramps of v (v/a + a/j) / 2, or of v sqrt(v/j) where the acceleration is not reached.
        v = plateau.speed
        expected = v * (v / 16 + 0.05) if v * 320 > 256 else 2 * v * np.sqrt(v / 320)
        assert ramps == pytest.approx(expected, abs=1e-7)


def test_a_short_range_lowers_the_speed_and_says_so(limits):
    """A speed that the range cannot hold gives way to the highest it can."""
    sweep = constant_speed_sweep(limits, 2, np.zeros(3), speeds=[0.2, 4.0], period=PERIOD)
    assert [p.shortened for p in sweep.plateaus] == [False, False, True, True]
    assert 0.2 < sweep.plateaus[2].speed < 4.0
    assert sweep.plateaus[2].duration == pytest.approx(0.1, abs=1e-9)


def test_an_endless_joint_makes_one_turn_about_the_pose(limits):
    """A joint without position limits is swept over one turn, or a fraction of it, about where it stands."""
    q = _khz(constant_speed_sweep(limits, 3, [0.0, 0.0, 9.0], speeds=[7.0], period=PERIOD)).q[:, 2]
    assert q.min() == pytest.approx(9.0 - np.pi, abs=1e-6)
    assert q.max() == pytest.approx(9.0 + np.pi, abs=1e-3)
    half = _khz(constant_speed_sweep(limits, 3, [0.0, 0.0, 9.0], speeds=[7.0], period=PERIOD, fraction=0.5)).q[:, 2]
    assert half.min() == pytest.approx(9.0 - np.pi / 2, abs=1e-6)


def test_speeds_are_spaced_by_ratio_or_by_step():
    """Logarithmic spacing has equal ratios, linear spacing equal steps, and the ends are exact."""
    speeds = spaced_speeds(0.01, 3.3, 6)
    np.testing.assert_allclose(speeds[1:] / speeds[:-1], 330.0 ** (1 / 5), rtol=1e-12)
    assert (speeds[0], speeds[-1]) == (0.01, 3.3)
    np.testing.assert_allclose(np.diff(spaced_speeds(1.0, 3.0, 5, logarithmic=False)), 0.5, rtol=1e-12)


def test_what_makes_no_sense_is_refused(limits):
    """Speeds above the limit, none at all, a fraction out of range and spacings that do not increase are errors."""
    for speeds in ([], [4.1], [0.0, 1.0]):
        with pytest.raises(InputError, match="joint 1: found the speeds"):
            constant_speed_sweep(limits, 1, np.zeros(3), speeds=speeds, period=PERIOD)
    with pytest.raises(InputError, match="of the range"):
        constant_speed_sweep(limits, 1, np.zeros(3), speeds=[1.0], period=PERIOD, fraction=1.2)
    for lowest, highest, count in ((0.0, 1.0, 3), (2.0, 1.0, 3), (1.0, 2.0, 1), (1.0, np.inf, 3)):
        with pytest.raises(InputError, match="speeds from"):
            spaced_speeds(lowest, highest, count)
