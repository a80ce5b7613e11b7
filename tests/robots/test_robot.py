"""What is known of a robot before any experiment."""

from __future__ import annotations

import numpy as np
import pytest

from robots.common.errors import InputError
from robots.geometry.dh import DhRow, chain_from_dh
from robots.limits import Limits
from robots.robot import Robot


def robot(n=2, **changes):
    ones = np.ones(n)
    limits = Limits(lower=-ones, upper=ones, velocity=ones, acceleration=ones, jerk=ones, torque=ones)
    chain = chain_from_dh([DhRow(a=1.0)] * n, "modified")
    return Robot(**{"name": "test", "chain": chain, "limits": limits, **changes})


def test_what_is_unknown_has_its_own_value():
    """Unknown inertia and torque constants are NaN, rotor inertia and friction zero, gear ratios one."""
    made = robot()
    assert np.isnan(made.inertia).all()
    assert np.isnan(made.torque_constant).all()
    assert not made.rotor_inertia.any()
    assert made.friction.shape == (2, 4)
    assert not made.friction.any()
    np.testing.assert_array_equal(made.gear_ratio, [1.0, 1.0])
    assert not made.has_inertia
    assert robot(inertia=np.ones((2, 10))).has_inertia


def test_arrays_are_copies_that_cannot_be_changed():
    """A robot keeps copies of its arrays, and they are read-only."""
    friction = np.ones((2, 4))
    made = robot(friction=friction)
    friction[0, 0] = 5.0
    assert made.friction[0, 0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        made.friction[0, 0] = 2.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"name": ""}, "no name"),
        ({"period": 0.0}, "a sample period of 0.0 s"),
        ({"period": np.nan}, "a sample period of nan s"),
        ({"inertia": np.ones((1, 10))}, r"inertia has the shape \(1, 10\); allowed: the shape \(2, 10\)"),
        ({"inertia": [[1] * 10, [np.nan] + [1] * 9]}, "joint 2: test: inertia is"),
        ({"rotor_inertia": [0.1, -0.1]}, "joint 2: test: rotor_inertia is -0.1; allowed: zero or more"),
        ({"rotor_inertia": [np.inf, 0.1]}, "joint 1: test: rotor_inertia is inf"),
        ({"rotor_inertia": "abc"}, "rotor_inertia is not numeric"),
        ({"friction": np.full((2, 4), np.nan)}, "joint 1: test: friction is"),
        ({"gear_ratio": [1.0, 0.0]}, "joint 2: test: gear_ratio is 0.0"),
        ({"torque_constant": [np.nan, 0.0]}, "joint 2: test: torque_constant is 0.0"),
        ({"chain": chain_from_dh([DhRow()], "modified")}, "limits of 2 joints; allowed: 1"),
    ],
)
def test_an_impossible_robot_is_refused(changes, message):
    """A robot whose parts do not fit or cannot be is refused, naming the joint."""
    with pytest.raises(InputError, match=message):
        robot(**changes)
