from dataclasses import replace

import numpy as np
import pytest

from estimation import identify
from estimation.preprocessing import Harmonics, LowPass, SmoothingSpline
from estimation.regressions.preparation import prepare, rows_of


@pytest.fixture(scope="module")
def stretches(arm, arm_log):
    return list(prepare(arm, arm_log()).stretches(4, 900))


@pytest.mark.parametrize("ends", [False, True])
@pytest.mark.parametrize("smoother", [LowPass(5.0), SmoothingSpline(5.0), Harmonics(1.7, 3)], ids=lambda s: s.name)
def test_stretches_smoothed_together_are_those_smoothed_alone(stretches, smoother, ends):
    """Columns of one signal come out as signals of their own."""
    found = rows_of(stretches, smoother, ends=ends)
    for together, log in zip(found, stretches, strict=True):
        alone = log.rows(smoother, ends=ends)
        assert np.array_equal(together.motion.t, alone.motion.t)
        assert np.array_equal(together.tau, alone.tau)
        assert np.array_equal(together.mask, alone.mask)
        for name in ("q", "dq", "ddq"):
            a, b = getattr(together.motion, name), getattr(alone.motion, name)
            # Periods and times differ by rounding from stretch to stretch, and differentiation multiplies it.
            np.testing.assert_allclose(a, b, rtol=1e-8, atol=1e-8 * np.abs(b).max())


def test_logs_that_differ_are_smoothed_one_by_one(arm, arm_log, stretches):
    """Another length, or uneven time, keeps a log from being a column among others."""
    short = prepare(arm, arm_log(1).rows(slice(0, 700)))
    found = rows_of([stretches[0], short], LowPass(5.0))
    assert [len(part.motion) for part in found] == [len(log.rows(5.0).motion) for log in (stretches[0], short)]


@pytest.mark.slow
def test_a_torque_that_never_changes_is_no_data(arm, arm_log):
    """A dead channel beside a moving joint: the other joint is fitted as well as before, not towards zero torque."""
    log = arm_log(seed=2)
    dead = replace(log, tau=log.tau * np.array([1.0, 0.0]))
    assert not prepare(arm, dead).rows(5.0).mask[:, 1].any()
    errors = [identify(arm, one, check=False).joints[0].held_out_rms for one in (log, dead)]
    assert errors[1] < 1.2 * errors[0]
