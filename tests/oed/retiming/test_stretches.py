import numpy as np
from numpy.polynomial import Polynomial

from oed.retiming.toppra_ import split_at_rests
from robots.signals import Motion

PERIOD = 0.004


def _step(duration: float = 1.0, start: float = 0.0, end: float = 1.0) -> Motion:
    t = np.arange(round(duration / PERIOD) + 1) * PERIOD
    x = Polynomial([0.0, 1.0 / duration])
    shape = start + (end - start) * x**4 * (35 - 84 * x + 70 * x**2 - 20 * x**3)
    return Motion(t, shape(t)[:, None], shape.deriv()(t)[:, None], shape.deriv(2)(t)[:, None])


def _join(*motions: Motion) -> Motion:
    q, dq, ddq = (np.concatenate([getattr(m, name) for m in motions]) for name in ("q", "dq", "ddq"))
    return Motion(PERIOD * np.arange(len(q)), q, dq, ddq)


def test_rests_separate_stretches_and_pauses_are_left_out():
    """There, a pause, and back are two smooth stretches that last as long as they do."""
    there, back = _step(), _step(start=1.0, end=0.0)
    hold = Motion(PERIOD * np.arange(100), np.ones((100, 1)), np.zeros((100, 1)), np.zeros((100, 1)))
    stretches = split_at_rests(_join(there, hold, back))
    assert [stretch.smooth for stretch in stretches] == [True, True]
    np.testing.assert_allclose([stretch.motion.duration for stretch in stretches], 1.0, atol=1e-9)
    np.testing.assert_allclose([s.motion.q[-1, 0] - s.motion.q[0, 0] for s in stretches], [1.0, -1.0], atol=1e-12)


def test_a_turn_under_acceleration_is_no_rest():
    """A single joint that turns back has no velocity there but acceleration: it need not stop."""
    t = np.arange(251) * PERIOD
    shape = Polynomial([0.0, 1.0])
    shape = (shape * (1 - shape)) ** 4
    motion = Motion(t, shape(t)[:, None], shape.deriv()(t)[:, None], shape.deriv(2)(t)[:, None])
    (stretch,) = split_at_rests(motion)
    assert stretch.smooth
    assert len(stretch.motion) == len(motion)


def test_a_motion_that_begins_under_way_is_not_smooth():
    """Its own timing cannot begin at rest."""
    assert [stretch.smooth for stretch in split_at_rests(_step().slice(50, None))] == [False]


def test_velocities_that_do_not_belong_to_the_positions_are_not_trusted():
    """Positions with zero velocities are one stretch whose timing is of no use."""
    motion = _step()
    (stretch,) = split_at_rests(Motion(motion.t, motion.q, 0 * motion.dq, 0 * motion.ddq))
    assert not stretch.smooth
    assert split_at_rests(Motion(motion.t, 0 * motion.q, 0 * motion.q, 0 * motion.q)) == []
