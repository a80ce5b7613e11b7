"""Change points of stored logs: places and sizes against an exhaustive search, and how rarely noise is called one."""

from __future__ import annotations

from itertools import combinations, pairwise

import numpy as np
import pytest

from estimation.monitoring import change_points
from estimation.monitoring.change_points import find_change_points
from estimation.monitoring.control_charts.level_filter import CORRELATION_TIME

pytest.importorskip("ruptures", reason="change points need the package ruptures")

STEP = 10.0
"""Length of a window [s]."""


def correlated(rng, count, std):
    """Noise (count,) of a first-order process with the correlation time that the windows have."""
    a = np.exp(-STEP / CORRELATION_TIME)
    noise = rng.normal(size=count)
    for k in range(1, count):
        noise[k] = a * noise[k - 1] + np.sqrt(1 - a * a) * noise[k]
    return std * noise


def history(rest):
    """What the function reads of a monitor's history."""
    return {"start": STEP * np.arange(len(rest)), "rest": np.asarray(rest)}


def exhaustive(y, changes, least=3):
    """Places of so many changes that leave the least squares, by trying all of them."""
    best, found = np.inf, ()
    for places in combinations(range(least, len(y) - least + 1), changes):
        edges = [0, *places, len(y)]
        parts = [y[a:b] for a, b in pairwise(edges)]
        cost = sum(((part - part.mean()) ** 2).sum() for part in parts)
        if min(map(len, parts)) >= least and cost < best:
            best, found = cost, places
    return found


@pytest.mark.parametrize("places", [(40,), (25, 60)])
def test_places_and_sizes_are_those_of_an_exhaustive_search(places):
    """Steps of 20 % in noise of 1 % are found where the least squares of all possible places are, with their sizes."""
    rng = np.random.default_rng(3)
    level = np.zeros(90)
    for place in places:
        level[place:] += np.log(1.2)
    rest = np.column_stack([correlated(rng, 90, 0.01), level + correlated(rng, 90, 0.01)])
    found = find_change_points(history(rest))
    assert [joint for joint, _, _ in found] == [2] * len(places)
    expected = exhaustive(rest[:, 1], len(places))
    assert [time / STEP for _, time, _ in found] == list(expected)
    edges = [0, *expected, 90]
    means = [rest[a:b, 1].mean() for a, b in pairwise(edges)]
    np.testing.assert_allclose([percent for _, _, percent in found], 100 * np.expm1(np.diff(means)), rtol=1e-12)


def test_noise_is_rarely_called_a_change():
    """Correlated noise without a change gives change points at a few of 240 joints at most.

    The chance at a joint is below 0.3 % (0 of 1200 measured). More than 5 points occur by chance once in 10^4 runs.
    """
    rng = np.random.default_rng(5)
    found = sum(
        len(find_change_points(history(np.column_stack([correlated(rng, 200, 0.02) for _ in range(6)]))))
        for _ in range(40)
    )
    assert found <= 5


def test_gaps_and_short_histories():
    """Unknown windows are left out, and the times are those of the others; a short history has no change points."""
    rng = np.random.default_rng(1)
    rest = np.where(np.arange(80) < 50, 0.0, 0.3)[:, None] + correlated(rng, 80, 0.01)[:, None]
    rest[10:20] = np.nan
    ((joint, time, percent),) = find_change_points(history(rest))
    assert (joint, time) == (1, 50 * STEP)
    assert percent == pytest.approx(100 * np.expm1(0.3), abs=2.0)
    assert find_change_points(history(rest[: change_points.FEWEST_POINTS - 1])) == ()
    assert find_change_points(history(np.full((40, 1), np.nan))) == ()
    assert find_change_points(history(np.zeros((0, 2)))) == ()


def test_long_histories_are_averaged_in_groups(monkeypatch):
    """A longer history than the search takes is averaged: the change is dated to a group, its size stays."""
    monkeypatch.setattr(change_points, "MOST_POINTS", 100)
    rng = np.random.default_rng(2)
    rest = np.where(np.arange(1000) < 640, 0.0, -0.2)[:, None] + correlated(rng, 1000, 0.01)[:, None]
    ((_, time, percent),) = find_change_points(history(rest))
    assert abs(time / STEP - 640) <= 10
    assert percent == pytest.approx(100 * np.expm1(-0.2), abs=1.0)


def test_constant_levels_have_no_change():
    """Exactly constant friction, without any noise, has no change; a step of it has one."""
    rest = np.zeros((60, 1))
    assert find_change_points(history(rest)) == ()
    rest[30:] = 0.1
    ((_, time, percent),) = find_change_points(history(rest))
    assert (time, percent) == (30 * STEP, pytest.approx(100 * np.expm1(0.1)))
