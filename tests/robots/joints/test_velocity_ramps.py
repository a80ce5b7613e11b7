"""Velocity limits that fall towards the ends of a joint."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from robots.common.errors import InputError
from robots.joints.velocity_ramps import VelocityRamp
from robots.limits import Limits
from robots.loading import load_robot
from robots.signals import Motion

ONE = np.ones(2)
LIMITS = Limits(
    lower=-2 * ONE,
    upper=2 * ONE,
    velocity=2 * ONE,
    acceleration=10 * ONE,
    jerk=100 * ONE,
    torque=np.inf * ONE,
    ramp=VelocityRamp(lower=-2 * ONE, upper=2 * ONE, offset=0.1 * ONE, deceleration=2 * ONE, reserve=0.1 * ONE),
)


def test_the_limit_of_a_state() -> None:
    """sqrt(2 a d) - offset - reserve towards the end ahead, no more than the velocity limit, and never below 0."""
    q = np.array([[0.0, 1.75], [1.75, -1.75], [2.0, 1.9999]])
    dq = np.array([[1.0, 1.0], [-1.0, -1.0], [1.0, 1.0]])
    expected = [[2.0, 0.8], [2.0, 0.8], [0.0, 0.0]]
    np.testing.assert_allclose(LIMITS.speed_limit(q, dq), expected)
    np.testing.assert_allclose(LIMITS.scaled(velocity=0.5).speed_limit(q, dq), np.array(expected) / 2)
    np.testing.assert_array_equal(replace(LIMITS, ramp=None).speed_limit(q, dq), [2.0, 2.0])


def test_margins() -> None:
    """The margin of the velocity is that to the limit of the place, with its time."""
    t = 0.1 * np.arange(3)
    q = np.array([[0.0, 0.0], [1.75, 0.0], [1.9, 0.0]])
    dq = np.array([[1.9, 0.0], [0.9, 0.0], [0.0, 0.1]])
    margin = next(m for m in LIMITS.margins(Motion(t, q, dq, 0 * q)) if m.quantity == "velocity" and m.joint == 1)
    assert (margin.value, margin.time) == (0.9, 0.1)
    np.testing.assert_allclose((margin.limit, margin.slack), (0.8, -0.1))


def test_files(tmp_path: Path) -> None:
    """A robot file states the ramp; wrong values and numbers are refused with their key."""
    head = "{name: two, geometry: {convention: modified, joints: [{}, {}]}, limits: {velocity_ramp: {"
    for text, problem in (
        ("lower: -2, upper: 2, offset: 0.1, deceleration: 2", ""),
        ("lower: [-2], upper: 2, offset: 0.1, deceleration: 2", "limits.velocity_ramp.lower"),
        ("lower: -2, upper: 2, offset: 0.1, deceleration: 0", "deceleration"),
        ("lower: 2, upper: 2, offset: 0.1, deceleration: 1", "lower < upper"),
        ("lower: -2, upper: 2, offset: -1, deceleration: 1", "offset"),
        ("lower: -2, upper: 2, deceleration: 1", "offset"),
    ):
        path = tmp_path / "two.yaml"
        path.write_text(head + text + "}, position: {lower: -1, upper: 1, unit: rad}}}")
        if problem:
            with pytest.raises(InputError, match=problem):
                load_robot(path)
        else:
            ramp = load_robot(path).limits.ramp
            assert ramp is not None
            np.testing.assert_array_equal(ramp.reserve, [0.0, 0.0])
    with pytest.raises(InputError, match="velocity_ramp"):
        replace(LIMITS, ramp=load_robot("fr3").limits.ramp)
