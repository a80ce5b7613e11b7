"""Play in a gear: the free flight of its link between two flanks, against an integrator, and the gaps of a scan."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from robots.terms.effects import EFFECTS
from robots.terms.effects.backlash import HOVERING_LOAD, _lag, _spread

Array = np.ndarray
LANDING = 0.012


def _integrated(t: Array, push: Callable[[float], float]) -> Array:
    """Integrates x'' = push(t) between stops at 1 and -1 that take all speed, by scipy with events."""

    def reaches(stop: float) -> Callable[[float, Array], float]:
        def event(_: float, state: Array) -> float:
            return float(state[0] - stop)

        event.terminal = True  # type: ignore[attr-defined]
        event.direction = np.sign(stop)  # type: ignore[attr-defined]
        return event

    position, now, side = np.empty(len(t)), t[0], np.sign(push(t[0] + 1e-6))
    while now < t[-1]:
        fine = np.arange(now, t[-1], 1e-5)
        leaves = next((float(x) for x in fine if side * push(x) < 0), t[-1])
        position[(t >= now) & (t <= leaves)] = side
        if leaves >= t[-1]:
            break
        start = [side * (1.0 - 1e-9), 0.0]
        rows = (t > leaves) & (t <= t[-1])
        flight = solve_ivp(
            lambda s, x: [x[1], push(s)], (leaves, t[-1]), start, events=[reaches(1.0), reaches(-1.0)],
            dense_output=True, max_step=0.005, rtol=1e-8,
        )  # fmt: skip
        now = float(flight.t[-1])
        rows &= t <= now
        position[rows] = flight.sol(t[rows])[0]
        side = np.sign(flight.y[0, -1])
        if now >= t[-1]:
            break
        now += 1e-9
    position[t > now] = side
    return position


@pytest.mark.parametrize("frequency", [0.4, 1.1])
def test_a_link_flies_between_its_flanks_as_an_integrator_says(frequency: float) -> None:
    """Away from landings the lag is that of scipy's integration with events; each landing is a few samples long."""
    t = np.arange(0.0, 5.0, 0.004)

    def push(at: float) -> float:
        return float(
            900.0 * np.sin(2 * np.pi * frequency * at + 0.4) + 250.0 * np.cos(2 * np.pi * 2.3 * frequency * at)
        )

    expected = _integrated(t, push)
    position = _lag(t, np.array([push(at) for at in t]))
    crossings = np.count_nonzero(np.diff(np.sign(expected)))
    assert crossings >= 3
    assert np.count_nonzero(np.diff(np.sign(position))) == crossings
    # On a grid of 4 ms, at speeds up to 40 per second.
    assert np.abs(position - expected).max() < 0.2
    assert np.sqrt(np.mean((position - expected) ** 2)) < 0.02


def test_a_landing_takes_as_long_as_stated() -> None:
    """A change of speed is spread over the landing, half before and half after it; nothing else changes."""
    t = np.arange(0.0, 1.0, 0.004)
    sharp = np.minimum(1.0, -1.0 + 10.0 * np.maximum(t - 0.3, 0.0))
    wide = _spread(sharp, 0.06, 0.004)
    changed = t[np.abs(wide - sharp) > 1e-9]
    assert np.ptp(changed[changed < 0.4]) == pytest.approx(0.06, abs=0.0125)  # three rows of 4 ms
    assert np.sum(np.gradient(wide, 0.004)) * 0.004 == pytest.approx(2.0, rel=1e-6)
    np.testing.assert_array_equal(_spread(sharp, 0.002, 0.004), sharp)


def test_a_load_that_hovers_about_zero_lets_no_link_cross() -> None:
    """Short pushes off the flank end before the gap is crossed: an axis without gravity, at even speed."""
    t = np.arange(0.0, 4.0, 0.004)
    hovering = np.where(t < 1.0, 1e3, 5.0 + 20.0 * np.sin(2 * np.pi * 10.0 * t))
    assert _lag(t, hovering).min() > 0.9


def test_the_motor_that_an_impact_moves_does_not_let_the_link_go() -> None:
    """A load that reverses for a moment right after the landing is the impact's own."""
    t = np.arange(0.0, 3.0, 0.004)
    plain = np.where(t < 1.0, 500.0, -500.0)
    lands = float(t[np.flatnonzero(_lag(t, plain) <= -1.0)[0]])
    struck = np.where((t > lands) & (t < lands + 0.02), 4e4, plain)
    np.testing.assert_array_equal(np.sign(_lag(t, struck)), np.sign(_lag(t, plain)))


@pytest.mark.slow
def test_sides_change_at_the_load_that_is_stated(seen) -> None:
    """With another zero of the load, impacts follow where the load passes it."""
    now = seen(5, seed=1)
    sizes = [np.sqrt(np.mean(now.load[:, joint - 1] ** 2)) for joint in range(1, 6)]
    joint = 1 + int(np.argmax([np.count_nonzero(np.diff(np.sign(now.load[:, j]))) for j in range(5)]))
    aside = 0.05 * sizes[joint - 1]
    X = EFFECTS["backlash"].columns(now, joint, (1e-7, aside, 0.0, LANDING))[:, joint - 1, 0]
    burst = np.abs(X) > 0.2 * np.abs(X).max()
    near = np.zeros(len(burst), dtype=bool)
    for i in np.flatnonzero(np.diff(np.sign(now.load[:, joint - 1] - aside))):
        near[max(i - 5, 0) : i + 9] = True  # a landing and the differences of its acceleration reach 5 rows
    assert burst.sum() >= 2
    assert not burst[~near].any()
    plain = EFFECTS["backlash"].columns(now, joint, (1e-7, 0.0, 0.0, LANDING))[:, joint - 1, 0]
    assert (np.abs(plain) > 0.2 * np.abs(plain).max())[~near].any()


def test_size_and_time_of_a_crossing_show_one_play(seen) -> None:
    """Half the play lies within a factor of two of what the crossing's time says; other effects are as described."""
    robot = seen(5, seed=4).robot
    assert EFFECTS["backlash"].ranges(robot, 1, (2e-3, 0.0, 0.0, 0.02)) == ((0.5e-3, 2e-3),)
    # No play is larger than a twentieth of a radian each way, whatever its time.
    assert EFFECTS["backlash"].ranges(robot, 1, (0.08, 0.0, 0.0, 0.02)) == ((0.02, 0.05),)
    described = EFFECTS["joint_elasticity"].parameters(robot, 1)
    assert EFFECTS["joint_elasticity"].ranges(robot, 1, (10.0, 0.0, 0.05)) == tuple(
        (c.lower, c.upper) for c in described
    )


def _sides_changed(load: Array) -> Array:
    """Rows before which a load was last of its old sign, one that exceeds a twentieth of its RMS beyond zero."""
    far, side, last, rows = HOVERING_LOAD * np.sqrt(np.mean(load**2)), 0.0, 0, []
    for k, (now, after) in enumerate(pairwise(load)):
        if abs(now) > far:
            side = side or np.sign(now)
        if now * after < 0:
            last = k
        if abs(after) > far and side and np.sign(after) != side:
            rows.append(last)
            side = np.sign(after)
    return np.array(rows)


def test_gaps_are_searched_that_take_from_a_sample_to_a_fifth_of_a_second(seen) -> None:
    """A slow load of a heavy link crosses late: half of the crossings of the largest gap of the scan take that long."""
    now = seen(5, seed=1)
    effect = EFFECTS["backlash"]
    turns = [np.count_nonzero(np.diff(np.sign(now.load[:, joint - 1]))) for joint in range(1, 6)]
    joint = 1 + int(np.argmax(turns))
    load = now.load[:, joint - 1]
    i = _sides_changed(load)
    quickness = np.abs(load[i + 1] - load[i]) / 0.004 / now.sensitivity("inertia")[i, joint - 1, joint - 1]
    gaps = sorted({gap for gap, *_ in effect.grid(now, joint)})
    flights = [float(np.median((6 * gap / quickness) ** (1 / 3))) for gap in gaps]
    assert flights[-1] == pytest.approx(0.2, rel=0.1)
    assert flights[0] < 0.03
