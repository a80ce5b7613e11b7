import dataclasses

import numpy as np
import pytest
import scipy.interpolate
from hypothesis import given, settings
from hypothesis import strategies as st

from oed.constraints import hull_matrices, spline_extremes, spline_rows
from robots.common.errors import InfeasibleError, InputError

DURATION = 4.0
QUANTITIES = ("q", "dq", "ddq", "dddq")


def _knots(count: int, degree: int) -> np.ndarray:
    inner = np.linspace(0.0, DURATION, count - degree + 1)
    return np.concatenate([np.zeros(degree), inner, np.full(degree, DURATION)])


def _expansion(count: int) -> np.ndarray:
    """Three equal control points at either end, as a motion from rest to rest has."""
    return np.eye(count - 4)[np.clip(np.arange(count) - 2, 0, count - 5)]


def _dense(knots: np.ndarray, controls: np.ndarray, degree: int, count: int = 4001) -> list[np.ndarray]:
    """Four quantities, the knots among the samples: there a spline of degree one peaks."""
    t = np.union1d(np.linspace(0.0, DURATION, count), knots)
    spline = scipy.interpolate.BSpline(knots, controls.T, degree)
    return [spline(t, nu=order).T for order in range(4)]


@settings(deadline=None)
@given(
    seed=st.integers(0, 10_000), degree=st.sampled_from([3, 4, 5]), extra=st.integers(1, 12), pieces=st.integers(1, 6)
)
def test_the_hull_contains_the_spline_at_all_times(seed, degree, extra, pieces):
    """The control points of each derivative, with and without inserted knots, enclose it at four thousand points."""
    count = degree + extra
    controls = np.random.default_rng(seed).normal(size=(2, count))
    knots = _knots(count, degree)
    extremes = spline_extremes(knots, controls, degree, refinement=pieces)
    for quantity, values in zip(QUANTITIES, _dense(knots, controls, degree), strict=True):
        rounding = 1e-12 * (1 + np.abs(values).max())
        assert np.all(extremes[quantity].highest >= values.max(axis=1) - rounding)
        assert np.all(extremes[quantity].lowest <= values.min(axis=1) + rounding)


@settings(deadline=None)
@given(seed=st.integers(0, 10_000), degree=st.sampled_from([3, 5]), extra=st.integers(1, 12), pieces=st.integers(1, 24))
def test_the_hull_is_tight_to_the_stated_bound(seed, degree, extra, pieces):
    """It is wider than the range by (d + 1) / 24 h^2 times the largest control point of the second derivative."""
    count = degree + extra
    controls = np.random.default_rng(seed).normal(size=(1, count))
    knots = _knots(count, degree)
    hulls = hull_matrices(knots, np.eye(count), degree, pieces)
    step = DURATION / (count - degree) / pieces
    spline = scipy.interpolate.BSpline(knots, controls[0], degree)
    for order, values in enumerate(_dense(knots, controls, degree)):
        # Control points of the second derivative; none is left of a line or a step.
        bend = np.abs(spline.derivative(order + 2).c[: count - order - 2]).max() if degree >= order + 2 else 0.0
        stated = (degree - order + 1) / 24 * step**2 * bend
        # The true peak may lie between samples 1e-3 s apart.
        unseen = 1e-6 / 8 * bend + 1e-11 * (1 + np.abs(values).max())
        points = hulls[order] @ controls[0]
        assert points.max() - values.max() <= stated + unseen
        assert values.min() - points.min() <= stated + unseen


@pytest.mark.parametrize("degree", [3, 5])
def test_sixteen_pieces_are_within_two_percent(degree):
    """On a motion of a dozen control points, sixteen pieces an interval leave at most 2 % of each peak unused."""
    controls = np.random.default_rng(degree).normal(size=(3, 8)) @ _expansion(12).T
    knots = _knots(12, degree)
    extremes = spline_extremes(knots, controls, degree)
    for quantity, values in zip(QUANTITIES, _dense(knots, controls, degree), strict=True):
        true = np.maximum(values.max(axis=1), -values.min(axis=1))
        certified = np.maximum(extremes[quantity].highest, -extremes[quantity].lowest)
        assert np.all(certified <= 1.02 * true)
        where = extremes[quantity].highest_at
        assert np.all((where >= 0.0) & (where <= 1.0))


def test_one_piece_and_many_describe_the_same_spline():
    """Knot insertion does not change the spline, nor any of its derivatives."""
    controls = np.random.default_rng(0).normal(size=9)
    knots = _knots(9, 5)
    t = np.linspace(0.0, DURATION, 301)
    inner = np.linspace(0.0, DURATION, 4 * 3 + 1)
    original = scipy.interpolate.BSpline(knots, controls, 5)
    for order, hull in enumerate(hull_matrices(knots, np.eye(9), 5, 3)):
        degree = 5 - order
        refined = np.concatenate([np.zeros(degree), inner, np.full(degree, DURATION)])
        again = scipy.interpolate.BSpline(refined, hull @ controls, degree)
        # Jerks of some 1e3 in double precision.
        np.testing.assert_allclose(again(t), original(t, nu=order), rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("degree", [3, 5])
@pytest.mark.parametrize("quantity", QUANTITIES)
def test_the_active_limit_is_met_and_not_passed(limits, degree, quantity):
    """A motion scaled up until the first row is met reaches that limit at 1 kHz to 2 %, and passes none."""
    loose = dataclasses.replace(
        limits,
        lower=np.full(2, -1e3),
        upper=np.full(2, 1e3),
        **{k: np.full(2, 1e9) for k in ("velocity", "acceleration", "jerk")},
    )
    name = {"q": "upper", "dq": "velocity", "ddq": "acceleration", "dddq": "jerk"}[quantity]
    active = dataclasses.replace(
        loose, **{name: getattr(limits, name)}, **({"lower": limits.lower} if quantity == "q" else {})
    )
    rows = spline_rows(_knots(13, degree), _expansion(13), degree, active, refinement=16)
    start = np.zeros((2, 9))
    if quantity == "q":
        start += (limits.lower + limits.upper)[:, None] / 2
    direction = np.random.default_rng(7).normal(size=start.shape)
    free = start + rows.largest_step(start, direction) * direction
    values = dict(zip(QUANTITIES, _dense(_knots(13, degree), free @ _expansion(13).T, degree), strict=True))[quantity]
    centre = start[:, :1] if quantity == "q" else 0.0
    reach = getattr(active, name) - (start[:, 0] if quantity == "q" else 0.0)
    used = (np.abs(values - centre).max(axis=1) / reach).max()
    assert 0.98 <= used <= 1.0 + 1e-12
    # Without the limit's rows it would be passed.
    others = spline_rows(
        _knots(13, degree), _expansion(13), degree, active, quantities=[q for q in QUANTITIES if q != quantity]
    )
    assert others.largest_step(start, direction) > 1.5 * rows.largest_step(start, direction)


def test_rows_are_control_points_without_zeros_and_repetitions(limits):
    """Rows are the labelled control points; those of the rest at the ends are left out."""
    knots, expansion = _knots(10, 5), _expansion(10)
    rows = spline_rows(knots, expansion, 5, limits)
    hulls = dict(zip(QUANTITIES, hull_matrices(knots, expansion, 5), strict=True))
    for row, (quantity, index) in zip(rows.matrix, rows.labels, strict=True):
        np.testing.assert_array_equal(row, hulls[quantity][index])
        assert np.abs(row).max() > 0.0
    assert len([label for label in rows.labels if label[0] == "q"]) == 6
    assert len([label for label in rows.labels if label[0] == "dq"]) == 5
    assert rows.matrix.shape[1] == 6
    assert rows.lower.shape == rows.upper.shape == (2, len(rows.labels))


def test_limits_that_no_joint_has_give_no_rows(limits):
    """Infinite limits give no rows; zero and one-sided ones and unknown quantities are errors that name the joint."""
    knots, expansion = _knots(10, 5), _expansion(10)
    free = dataclasses.replace(limits, jerk=np.full(2, np.inf))
    assert {label for label, _ in spline_rows(knots, expansion, 5, free).labels} == {"q", "dq", "ddq"}
    still = dataclasses.replace(limits, velocity=np.array([4.0, 0.0]))
    with pytest.raises(InfeasibleError, match="joint 2"):
        spline_rows(knots, expansion, 5, still)
    lonely = dataclasses.replace(limits, lower=np.array([-np.inf, -0.2]))
    with pytest.raises(InputError, match="joint 1: has a q limit on one side"):
        spline_rows(knots, expansion, 5, lonely)
    with pytest.raises(InputError, match="torque"):
        spline_rows(knots, expansion, 5, limits, quantities=("torque",))


def test_numbers_that_do_not_fit_are_refused():
    """Knots, degrees, refinements and control points that do not fit are errors."""
    knots = _knots(10, 5)
    for arguments in ((knots[:-1], np.eye(10), 5), (knots, np.eye(10), 2), (knots[::-1], np.eye(10), 5)):
        with pytest.raises(InputError, match="knots"):
            hull_matrices(*arguments)
    for refinement in (0, 1.5):
        with pytest.raises(InputError, match="refinement"):
            hull_matrices(knots, np.eye(10), 5, refinement)
    with pytest.raises(InputError, match="dimensions"):
        spline_extremes(knots, np.zeros(10), 5)
