import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from oed.constraints import kinematic_rows, overshoot_factor, series_extremes
from robots.common.errors import InfeasibleError, InputError

HARMONICS, SAMPLES, FREQUENCY = 4, 40, 0.2
SHARES = (overshoot_factor(HARMONICS, SAMPLES),) * 4


def _basis() -> list[np.ndarray]:
    """The four matrices for [q0, a, b], straight from the formula."""
    t = np.arange(SAMPLES)[:, None] / (SAMPLES * FREQUENCY)
    w = 2 * np.pi * FREQUENCY * np.arange(1, HARMONICS + 1)
    s, c, zero = np.sin(w * t), np.cos(w * t), np.zeros((SAMPLES, 1))
    return [
        np.hstack([zero + 1, s / w, -c / w]),
        np.hstack([zero, c, s]),
        np.hstack([zero, -w * s, w * c]),
        np.hstack([zero, -(w**2) * c, -(w**2) * s]),
    ]


def test_rows_are_the_kinematics_at_the_samples(limits):
    """Each row times a joint's coefficients is the labelled quantity at the labelled sample."""
    basis = _basis()
    rows = kinematic_rows(basis, limits, shares=SHARES)
    assert rows.matrix.shape == (4 * SAMPLES, 2 * HARMONICS + 1)
    assert rows.lower.shape == rows.upper.shape == (2, 4 * SAMPLES)
    x = np.random.default_rng(0).normal(size=2 * HARMONICS + 1)
    for index in (0, 39, 40, 95, 159):
        quantity, sample = rows.labels[index]
        matrix = basis[("q", "dq", "ddq", "dddq").index(quantity)]
        assert rows.matrix[index] @ x == pytest.approx(matrix[sample] @ x)


@pytest.mark.slow
@settings(deadline=None)
@given(seed=st.integers(0, 10_000))
def test_coefficients_that_keep_the_rows_keep_the_limits_at_all_times(limits, seed):
    """The farthest step in any direction that the rows allow keeps every limit between the samples too."""
    rows = kinematic_rows(_basis(), limits, shares=SHARES)
    start = np.zeros((2, 2 * HARMONICS + 1))
    start[:, 0] = (limits.lower + limits.upper) / 2
    direction = np.random.default_rng(seed).normal(size=start.shape)
    step = rows.largest_step(start, direction)
    extremes = series_extremes(start + step * direction, FREQUENCY)
    # Limits of up to 320 in double precision.
    assert np.all(extremes["q"].lowest >= limits.lower - 1e-10)
    assert np.all(extremes["q"].highest <= limits.upper + 1e-10)
    for quantity, bound in (("dq", limits.velocity), ("ddq", limits.acceleration), ("dddq", limits.jerk)):
        assert np.all(np.maximum(extremes[quantity].highest, -extremes[quantity].lowest) <= bound * (1 + 1e-12))
    # The step is the largest: a little more passes a row.
    assert rows.excess(start + step * direction).max() == pytest.approx(0.0, abs=1e-10)
    assert rows.excess(start + 1.001 * step * direction).max() > 0.0


def test_excess_and_working_set(limits):
    """Excess is -1 in the middle and 0 on a bound; the working set holds what is near or passed."""
    rows = kinematic_rows(_basis(), limits, shares=SHARES, quantities=("dq",))
    middle = np.zeros((2, 2 * HARMONICS + 1))
    np.testing.assert_array_equal(rows.excess(middle), -1.0)
    assert not rows.working_set(middle).any()
    fast = middle.copy()
    fast[0, 1] = rows.upper[0, 0]  # cosine of the velocity: on the bound at t = 0
    assert rows.excess(fast)[0, 0] == pytest.approx(0.0, abs=1e-15)
    working = rows.working_set(fast, within=0.1)
    assert working[0, 0]
    assert not working[1].any()
    assert 0 < working[0].sum() < SAMPLES


def test_limits_that_no_joint_has_give_no_rows(limits):
    """Infinite limits of all joints give no rows; of one joint, infinite bounds and no excess."""
    free = dataclasses.replace(limits, jerk=np.full(2, np.inf), acceleration=np.array([np.inf, 12.0]))
    rows = kinematic_rows(_basis(), free, shares=SHARES)
    assert {quantity for quantity, _ in rows.labels} == {"q", "dq", "ddq"}
    accelerations = [index for index, (quantity, _) in enumerate(rows.labels) if quantity == "ddq"]
    x = np.full((2, 2 * HARMONICS + 1), 1e6)
    assert np.all(np.isneginf(rows.excess(x)[0, accelerations]))
    assert np.isfinite(rows.excess(x)[1, accelerations]).all()
    assert rows.largest_step(np.zeros_like(x), np.zeros_like(x)) == np.inf
    none = kinematic_rows(_basis(), free, shares=SHARES, quantities=("dddq",))
    assert none.matrix.shape == (0, 2 * HARMONICS + 1)


def test_a_zero_velocity_limit_is_infeasible(limits):
    """A joint that may not move makes the design infeasible, and the error names it."""
    still = dataclasses.replace(limits, velocity=np.array([4.0, 0.0]))
    with pytest.raises(InfeasibleError, match="joint 2"):
        kinematic_rows(_basis(), still, shares=SHARES)


def test_unknown_quantities_are_refused(limits):
    """A misspelt quantity is an error."""
    with pytest.raises(InputError, match="torque"):
        kinematic_rows(_basis(), limits, shares=SHARES, quantities=("torque",))
