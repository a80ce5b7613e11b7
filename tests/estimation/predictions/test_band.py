"""The band of a prediction: friction beyond the fitted speeds is known no better than the curve bends within them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimation import Model, identify
from estimation.predictions.band import band_of_motion, beyond_the_recorded
from robots.signals import Motion

FITTED = 1.5


@pytest.fixture(scope="module")
def model(arm, arm_log) -> Model:
    """An identified arm whose errors and friction are set by hand; speeds up to 1.5 rad/s count as recorded."""
    found = identify(arm, arm_log()).model
    size = len(found.values)
    known = {
        "band95": [0.2, 0.1],
        "band_growth": [2.0, 2.0],
        "band_reach": [1.0, 1.0],
        "band_covariance": np.zeros((size, size)).tolist(),
        "recorded": {**found.provenance["recorded"], "velocity": [[FITTED, FITTED]]},
    }
    return replace(found, provenance={**found.provenance, **known})


def sweep(speeds: np.ndarray) -> Motion:
    """States of both joints at these speeds."""
    dq = np.column_stack([speeds, -speeds])
    return Motion(0.01 * np.arange(len(speeds)), np.zeros_like(dq), dq, np.zeros_like(dq))


def friction(model: Model, speed: float) -> np.ndarray:
    """Friction (2,) at a speed, by the odd part of the torque in the speed."""
    zero = np.zeros((1, 2))
    there, back = (model.torque(zero, np.full((1, 2), sign * speed), zero)[0] for sign in (1, -1))
    return (there - back) / 2


def test_the_band_within_the_fitted_speeds_is_that_of_the_fit(model: Model) -> None:
    """Up to the fitted speed nothing is added: the parameters have no errors here."""
    half, _ = band_of_motion(model, sweep(np.linspace(-FITTED, FITTED, 31)), None)
    np.testing.assert_allclose(half, np.broadcast_to([0.2, 0.1], half.shape))


def test_friction_beyond_the_fitted_speeds_widens_the_band(model: Model) -> None:
    """By the model's own way on and a straight line with the slope of the upper half, in both directions of motion.

    The second joint's friction is a straight line above a tenth of the speed: both ways on are the same.
    """
    places = {column.symbol: i for i, column in enumerate(model.parameters) if column.friction and column.joint == 1}
    second = {column.symbol: i for i, column in enumerate(model.parameters) if column.friction and column.joint == 2}
    values = model.values.copy()
    values[list(places.values())] = [1.0, 2.0, 0.0, -2.0]
    values[list(second.values())] = [1.0, 2.0, 0.0, 0.0]
    bent = replace(model, values=values)
    speeds = np.array([-3 * FITTED, 3 * FITTED, 2 * FITTED])
    half, _ = band_of_motion(bent, sweep(speeds), None)
    at = {share: friction(bent, share * FITTED)[0] for share in (0.5, 1.0, 2.0, 3.0)}
    slope = (at[1.0] - at[0.5]) / (0.5 * FITTED)
    expected = [abs(at[share] - at[1.0] - slope * (share - 1) * FITTED) for share in (3.0, 3.0, 2.0)]
    np.testing.assert_allclose(half[:, 0], np.hypot(0.2, 1.959964 * np.array(expected)), rtol=1e-6)
    np.testing.assert_allclose(half[:, 1], 0.1, rtol=1e-6)
    assert (half[:, 0] > 0.25).all()


@pytest.mark.parametrize("stated", [True, False])
def test_a_joint_at_rest_has_a_band_of_its_slow_friction(model: Model, stated: bool) -> None:
    """With or without a covariance: a model of a diagnosis has none."""
    known = {key: value for key, value in model.provenance.items() if stated or not key.endswith("_covariance")}
    speeds = np.array([0.0, 0.0, FITTED])
    rest = np.array([[True, True], [False, False], [False, False]])
    half, beyond = band_of_motion(replace(model, provenance=known), sweep(speeds), None, rest)
    slow = np.max([friction(model, share * FITTED) for share in (0.05, 0.1, 0.2)], axis=0)
    np.testing.assert_allclose(half[0], np.add([0.2, 0.1], slow), rtol=1e-6)
    np.testing.assert_allclose(half[1:], np.broadcast_to([0.2, 0.1], (2, 2)))
    assert not beyond.any()


def test_large_ratios_are_written_as_people_do(model: Model) -> None:
    """A hundred times the recorded speed is 100 and not 1e+02."""
    first, *_ = beyond_the_recorded(model, sweep(np.array([0.0, 99.8 * FITTED])))
    assert "100 times the recorded speed" in first
