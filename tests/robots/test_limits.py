from dataclasses import replace

import numpy as np
import pytest

from robots.common.errors import InputError
from robots.limits import Limits, finite_jerk, symmetric_margins
from robots.signals import Motion

NAMES = ("lower", "upper", "velocity", "acceleration", "jerk", "torque")


def limits(**changes):
    values = {"lower": [-1.0, -2.0], "upper": [1.0, 3.0], **{name: [2.0, 4.0] for name in NAMES[2:]}}
    return Limits(**{**values, **changes})


def sine(rows=2001):
    """The motion q = a sin(w t): its extremes are known in closed form."""
    t = np.linspace(5.0, 7.0, rows)
    amplitude, rate, phase = np.array([0.5, 1.0]), np.pi, t[:, None] - 5.0
    q = amplitude * np.sin(rate * phase)
    return Motion(t, q, amplitude * rate * np.cos(rate * phase), -(rate**2) * q)


@pytest.mark.parametrize("name", NAMES)
def test_arrays_are_private_read_only_copies(name):
    """Bounds cannot be changed, neither through the object nor through what was given."""
    given = np.array([0.25, 0.5]) if name != "lower" else np.array([-0.25, -0.5])
    made = limits(**{name: given})
    expected = given.copy()
    given[0] = 0.3
    np.testing.assert_array_equal(getattr(made, name), expected)
    with pytest.raises(ValueError, match="read-only"):
        getattr(made, name)[0] = 0.0
    assert made.n == 2


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("value", [1.0, [], [1.0], [1.0, 2.0, 3.0], [[1.0, 2.0]], ["a", "b"], [np.nan, 1.0], None])
def test_bound_that_is_no_number_a_joint_is_refused(name, value):
    """A bound is one number for each joint, NaN excluded."""
    with pytest.raises(InputError):
        limits(**{name: value})


@pytest.mark.parametrize("name", NAMES[2:])
def test_negative_bound_is_refused_with_its_joint(name):
    """A magnitude below zero names the joint; infinity is accepted, and zero but of a torque, which moves nothing."""
    with pytest.raises(InputError) as caught:
        limits(**{name: [1.0, -1.0]})
    assert (caught.value.column, caught.value.joint) == (name, 2)
    if name == "torque":
        with pytest.raises(InputError, match="joint 1: found 0; allowed: above zero, or inf where unknown"):
            limits(torque=[0.0, np.inf])
        return
    assert getattr(limits(**{name: [0.0, np.inf]}), name).tolist() == [0.0, np.inf]


@pytest.mark.parametrize("upper", [-2.0, -2.5])
def test_lower_position_is_below_the_upper(upper):
    """Position limits that leave no range name the joint and both values."""
    with pytest.raises(InputError, match="lower -2 is not below upper") as caught:
        limits(upper=[1.0, upper])
    assert caught.value.joint == 2


def test_scaled_limits_keep_positions():
    """Factors multiply their own bounds; infinite ones stay."""
    made = limits(velocity=[np.inf, 4.0]).scaled(velocity=0.5, acceleration=2.0, jerk=3.0, torque=0.25)
    expected = {"lower": [-1, -2], "upper": [1, 3], "velocity": [np.inf, 2], "acceleration": [4, 8], "jerk": [6, 12]}
    for name, values in {**expected, "torque": [0.5, 1]}.items():
        assert getattr(made, name).tolist() == values


@pytest.mark.parametrize("factor", [0.0, -1.0, np.nan, np.inf])
@pytest.mark.parametrize("name", ["velocity", "acceleration", "jerk", "torque"])
def test_factor_is_a_positive_number(name, factor):
    """Zero, negative and infinite factors are refused by name."""
    with pytest.raises(InputError) as caught:
        limits().scaled(**{name: factor})
    assert caught.value.column == name


def test_margins_of_a_sine_are_those_of_its_extremes():
    """Each quantity and joint has one margin, at the extreme of the closed form, with time, value and limit."""
    motion = sine()
    margins = {(margin.quantity, margin.joint): margin for margin in limits().margins(motion)}
    quantities = ("lower", "upper", "velocity", "acceleration", "jerk")
    assert list(margins) == [(quantity, joint) for quantity in quantities for joint in (1, 2)]
    # The extremes fall on samples, so only rounding separates the values; pi and its powers are about 10.
    exact = {"rel": 1e-12}
    lower, upper = margins["lower", 1], margins["upper", 2]
    assert (lower.value, lower.time, lower.limit) == (pytest.approx(-0.5, **exact), pytest.approx(6.5), -1.0)
    assert (lower.slack, lower.slack_fraction) == (pytest.approx(0.5, **exact), pytest.approx(0.25, **exact))
    assert (upper.value, upper.time, upper.limit) == (pytest.approx(1.0, **exact), pytest.approx(5.5), 3.0)
    assert (upper.slack, upper.slack_fraction) == (pytest.approx(2.0, **exact), pytest.approx(0.4, **exact))
    velocity, acceleration = margins["velocity", 2], margins["acceleration", 1]
    assert abs(velocity.value) == pytest.approx(np.pi, **exact)
    assert velocity.slack_fraction == pytest.approx(1 - np.pi / 4, **exact)
    assert abs(acceleration.value) == pytest.approx(np.pi**2 / 2, **exact)
    assert acceleration.slack == pytest.approx(2 - np.pi**2 / 2, **exact)
    assert acceleration.violated
    assert not velocity.violated


def test_jerk_is_the_difference_of_the_acceleration():
    """The jerk of a sine comes out to second order in the step, in mid step; the bound is w^5 a h^2 / 24."""
    motion = sine()
    middle, jerk = finite_jerk(motion)
    exact = -np.array([0.5, 1.0]) * np.pi**3 * np.cos(np.pi * (middle[:, None] - 5.0))
    # Rounding of the accelerations (1e-15) over the step adds 1e-11.
    assert np.abs(jerk - exact).max() < np.pi**5 * 0.001**2 / 24 + 1e-10
    margin = limits().margins(motion)[-1]
    assert (margin.quantity, margin.joint) == ("jerk", 2)
    assert margin.value in jerk[:, 1]
    assert margin.time in middle


def test_jerk_over_uneven_steps_uses_their_length():
    """A step of another length has its own divisor."""
    motion = Motion([0.0, 1.0, 3.0], [[0.0]] * 3, [[0.0]] * 3, [[0.0], [2.0], [8.0]])
    middle, jerk = finite_jerk(motion)
    assert (middle.tolist(), jerk.tolist()) == ([0.5, 2.0], [[2.0], [3.0]])


def test_motion_of_one_sample_has_no_jerk():
    """A single sample has margins of everything but jerk."""
    motion = Motion([0.0], [[0.1, 0.2]], [[0.0, 0.0]], [[0.0, 0.0]])
    assert {margin.quantity for margin in limits().margins(motion)} == {"lower", "upper", "velocity", "acceleration"}


def test_margins_of_a_motion_of_other_joints_are_refused():
    """Both numbers of joints are named."""
    with pytest.raises(InputError, match="3 joints, the limits are for 2"):
        limits().margins(Motion([0.0], *[np.zeros((1, 3))] * 3))


@pytest.mark.parametrize(
    ("lower", "upper", "q", "fractions"),
    [
        (-np.inf, np.inf, 5.0, (1.0, 1.0)),
        (-1.0, np.inf, -2.0, (-1.0, 1.0)),
        (-np.inf, 4.0, 2.0, (1.0, 0.5)),
        (-1.0, 1.0, 1.5, (1.25, -0.25)),
    ],
)
def test_open_ranges_still_show_violations(lower, upper, q, fractions):
    """Without a bound the slack is full; a range open at one end is measured by its bound."""
    margins = limits(lower=[lower, -9.0], upper=[upper, 9.0]).margins(Motion([0.0], [[q, 0.0]], *[[[0.0, 0.0]]] * 2))
    found = [margin.slack_fraction for margin in margins if margin.joint == 1][:2]
    assert tuple(found) == fractions


@pytest.mark.parametrize(("value", "fraction"), [(0.0, 0.0), (0.1, -np.inf)])
def test_limit_of_zero_is_met_by_rest_only(value, fraction):
    """A bound of zero has no slack at rest and is violated by any motion."""
    (margin,) = symmetric_margins("velocity", np.array([0.0]), np.array([[value]]), np.array([0.0]))
    assert margin.slack_fraction == fraction
    assert margin.violated == (value > 0.0)


def test_any_signal_has_margins():
    """A signal such as torque is compared by magnitude; the first of equal extremes counts, and its sign is kept."""
    torque = np.array([[0.0, 1.0], [-3.0, 2.0], [3.0, 2.0]])
    first, second = symmetric_margins("torque", np.array([0.0, 0.5, 1.0]), torque, np.array([4.0, np.inf]))
    assert (first.joint, first.value, first.limit, first.time, first.slack_fraction) == (1, -3.0, 4.0, 0.5, 0.25)
    assert (second.joint, second.time, second.slack_fraction, second.violated) == (2, 0.5, 1.0, False)


@pytest.mark.parametrize(
    ("values", "limit"),
    [
        ([[1.0]], [1.0, 2.0]),
        ([[1.0, 2.0]] * 2, [1.0, 2.0]),
        ([1.0], [1.0]),
        ([[np.nan, 1.0]], [1.0, 2.0]),
        ([[1.0, 1.0]], [1.0, -2.0]),
    ],
)
def test_signal_that_does_not_fit_is_refused(values, limit):
    """Other shapes, values that are not finite, and negative bounds are input errors of that quantity."""
    with pytest.raises(InputError) as caught:
        symmetric_margins("torque", np.array([0.0]), np.array(values), np.array(limit))
    assert caught.value.column == "torque"


def test_units_of_quantities():
    """A joint's quantities have the units of its kind; an unknown quantity has none."""
    bounds = np.ones(2)
    limits = Limits(
        lower=-bounds,
        upper=bounds,
        velocity=bounds,
        acceleration=bounds,
        jerk=bounds,
        torque=bounds,
        kinds=("revolute", "prismatic"),
    )
    quantities = ("position", "lower", "velocity", "acceleration", "jerk", "torque", "torque RMS", "motor speed")
    assert [limits.unit(0, name) for name in quantities] == [
        *("rad", "rad", "rad/s", "rad/s2", "rad/s3", "N m", "N m", "")
    ]
    assert [limits.unit(1, name) for name in quantities] == ["m", "m", "m/s", "m/s2", "m/s3", "N", "N", ""]
    assert limits.position_unit == "rad or m"
    assert replace(limits, kinds=()).position_unit == "rad"
    assert limits.scaled(velocity=0.5).kinds == limits.kinds
    with pytest.raises(InputError, match="found the kinds"):
        replace(limits, kinds=("revolute",))
    with pytest.raises(InputError, match="found the kinds"):
        replace(limits, kinds=("revolute", "screw"))


def test_the_middle_is_finite():
    """The middle of an endless range is zero or its one end, without a warning."""
    ends = np.array([-np.inf, -1.0, 2.0, -np.inf]), np.array([np.inf, 3.0, np.inf, -5.0])
    bounds = np.ones(4)
    limits = Limits(lower=ends[0], upper=ends[1], velocity=bounds, acceleration=bounds, jerk=bounds, torque=bounds)
    np.testing.assert_array_equal(limits.middle, [0.0, 1.0, 2.0, -5.0])
    np.testing.assert_array_equal(limits.home, [0.0, 0.0, 2.0, -5.0])
