"""Specification of the fit of any arm: it knows no axes, zeros, signs and units."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimation.gate.context import Context
from estimation.gate.meanings.any_arm import any_arm


@pytest.mark.slow
def test_error_does_not_depend_on_the_description(er3a, good):
    """Zeros, signs and order of the joints and units of torque change nothing; shuffled torques are not explained."""
    log = good()
    plain = any_arm(Context(er3a, log).fitted).unexplained
    assert (plain < 0.35).all()
    order, sign = np.array([3, 0, 5, 1, 2, 4]), np.array([1.0, -1, 1, 1, -1, 1])
    units = np.array([1.0, 1000, 0.01, 1, 1, 5])
    q, tau = (log.q * sign + 0.3)[:, order], (log.tau * sign * units)[:, order]
    other = any_arm(Context(er3a, replace(log, q=q, tau=tau)).fitted).unexplained
    # The cut-off of the smoothing is chosen by the description, and differs: errors of some 5 % by a few tenths.
    np.testing.assert_allclose(other, plain[order], rtol=0.3)
    noise = np.random.default_rng(0).permutation(log.tau)
    assert (any_arm(Context(er3a, replace(log, tau=noise)).fitted).unexplained > 0.95).all()
