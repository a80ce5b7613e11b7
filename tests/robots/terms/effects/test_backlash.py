"""Play in a gear: when its link changes sides, in what time, and which gaps are looked for."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from robots.terms.effects import EFFECTS
from robots.terms.effects.backlash import QUICKEST, SLOWEST


@pytest.mark.slow
@pytest.mark.parametrize(("free", "longest"), [(0.05, 0.1), (0.08, 0.05)])
def test_a_loose_gear_lets_its_link_cross(seen, free, longest):
    """Where the load changes sign the link flies over, as long as the growing load needs, or the longest time.

    Then the flank stops it for good: what it is pushed by adds up to nothing, and twice summed up to the gap.
    """
    now = seen(5, seed=1)
    loads = [now.load[:, joint - 1] for joint in range(1, 6)]
    joint = 1 + int(np.argmax([np.count_nonzero(np.diff(np.sign(load))) for load in loads]))
    load = loads[joint - 1]
    inertia = now.sensitivity("inertia")[:, joint - 1, joint - 1]
    i = int(np.flatnonzero(np.diff(np.sign(load)))[0])
    quickness = abs(load[i + 1] - load[i]) / 0.004 / inertia[i]
    gap = free**3 * quickness / 6  # crossed in 50 ms, or in 80 ms
    X = EFFECTS["backlash"].columns(now, joint, (gap, longest, 0.0, 0.0, 0.04))[:, joint - 1, 0]
    start = now.t[i] - load[i] / (load[i + 1] - load[i]) * 0.004
    flies = (now.t > start) & (now.t < start + 0.05)
    during = (now.t > start - 0.004) & (now.t < start + 0.05 + 3 * 0.04 + 0.004)
    # The lag's own torque, through d rigid/dq, is small beside what its acceleration takes.
    pushed = np.where(during, -X * np.sign(load[i + 1]) / inertia, 0.0)
    since = now.t[flies] - start
    slope = float(np.sum(pushed[flies] * since) / np.sum(since**2))
    assert np.abs(pushed[flies] - slope * since).max() < 0.03 * pushed[flies].max()
    speed = np.cumsum(pushed) * 0.004
    assert speed.max() == pytest.approx(slope * 0.05**2 / 2, rel=0.1)
    assert abs(speed[during][-1]) < 0.05 * speed.max()
    assert speed.min() == pytest.approx(-0.2 * speed.max(), abs=0.05 * speed.max())
    assert np.sum(speed[during]) * 0.004 == pytest.approx(2.0, rel=0.1)  # from half a gap of one to the other


@pytest.mark.slow
def test_sides_change_at_the_load_that_is_said(seen):
    """With another zero of the load, the lag's bursts are where the load passes it, and nowhere before."""
    now = seen(5, seed=1)
    sizes = [np.sqrt(np.mean(now.load[:, joint - 1] ** 2)) for joint in range(1, 6)]
    joint = 1 + int(np.argmax([np.count_nonzero(np.diff(np.sign(now.load[:, j]))) for j in range(5)]))
    aside = 0.05 * sizes[joint - 1]
    gap = 0.01**3 / 6  # crossed within some samples
    X = EFFECTS["backlash"].columns(now, joint, (gap, 0.012, aside, 0.0, QUICKEST))[:, joint - 1, 0]
    burst = np.abs(X) > 0.2 * np.abs(X).max()
    passed = np.flatnonzero(np.diff(np.sign(now.load[:, joint - 1] - aside)))
    near = np.zeros(len(burst), dtype=bool)
    for i in passed:
        near[i : i + 6] = True
    assert burst.sum() >= 2
    assert not burst[~near].any()
    plain = EFFECTS["backlash"].columns(now, joint, (gap, 0.012, 0.0, 0.0, QUICKEST))[:, joint - 1, 0]
    assert (np.abs(plain) > 0.2 * np.abs(plain).max())[~near].any()


def test_size_and_time_of_a_crossing_tell_one_play(seen):
    """Half the play lies within a factor of eight of what the crossing's time says; other effects are as described."""
    robot = seen(5, seed=4).robot
    assert EFFECTS["backlash"].ranges(robot, 1, (2e-3, 0.1, 0.0, 0.0, 0.02)) == ((0.125e-3, 8e-3),)
    # No play is larger than a twentieth of a radian each way, whatever its time.
    assert EFFECTS["backlash"].ranges(robot, 1, (0.2, 0.1, 0.0, 0.0, 0.02)) == ((0.0125, 0.05),)
    described = EFFECTS["joint_elasticity"].parameters(robot, 1)
    assert EFFECTS["joint_elasticity"].ranges(robot, 1, (10.0, 0.0)) == tuple((c.lower, c.upper) for c in described)


def _sides_changed(load: np.ndarray) -> np.ndarray:
    """Rows before which a load was last of its old sign, one that gets a twentieth of its RMS beyond zero."""
    far, side, last, rows = 0.05 * np.sqrt(np.mean(load**2)), 0.0, 0, []
    for k, (now, after) in enumerate(pairwise(load)):
        if abs(now) > far:
            side = side or np.sign(now)
        if now * after < 0:
            last = k
        if abs(after) > far and side and np.sign(after) != side:
            rows.append(last)
            side = np.sign(after)
    return np.array(rows)


def test_a_load_that_hovers_about_zero_changes_no_side(seen, monkeypatch):
    """Its link stays on its flank until the load is on the other side for good: an axis without gravity, at even speed.

    What is then left of the load is what is not known of the acceleration.
    """
    now = seen(2, seed=2)
    early, late = now.t < now.t[500], now.t >= now.t[1000]
    hovering = 0.03 * np.sin(300.0 * now.t)
    load = np.where(early, 1.0, np.where(late, -1.0, hovering))
    monkeypatch.setattr(type(now), "load", property(lambda self: np.column_stack([load, load])))
    moved = EFFECTS["backlash"].columns(now, 1, (1e-7, SLOWEST, 0.0, 0.0, 0.02))[:, 0, 0]
    monkeypatch.setattr(type(now), "load", property(lambda self: np.column_stack([np.where(late, -1.0, 1.0)] * 2)))
    once = EFFECTS["backlash"].columns(now, 1, (1e-7, SLOWEST, 0.0, 0.0, 0.02))[:, 0, 0]
    # The last time that it crosses zero before it stays below: within one of its waves of the end.
    kicks, only = (np.flatnonzero(np.abs(x) > 0.1 * np.abs(x).max()) for x in (moved, once))
    assert len(kicks) <= 2 * len(only)
    assert abs(kicks.mean() - only.mean()) < 6


def test_gaps_are_looked_for_that_take_from_a_sample_to_a_fifth_of_a_second(seen):
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
    assert flights[-1] == pytest.approx(0.2, rel=0.05)
    assert flights[0] < 0.03
    assert flights[-1] < SLOWEST


def test_a_gap_too_large_for_its_time_may_be_crossed_with_the_motor(seen):
    """Free flight in a time asks for a gap; where the torque tells a larger one, the motor may set the time."""
    now = seen(5, seed=1)
    effect, small, large = EFFECTS["backlash"], 1e-5, 4e-4
    turns = [np.count_nonzero(np.diff(np.sign(now.load[:, joint - 1]))) for joint in range(1, 6)]
    joint = 1 + int(np.argmax(turns))
    (((gap, longest, *rest),),) = effect.other_optima(now, joint, (small, 0.1, 0.0, 0.0, 0.03), np.array([large / 2]))
    assert (gap, rest) == (pytest.approx(large), [0.0, 0.0, 0.03])
    load = now.load[:, joint - 1]
    i = _sides_changed(load)
    inertia = now.sensitivity("inertia")[i, joint - 1, joint - 1]
    flights = (6 * small * inertia / (np.abs(load[i + 1] - load[i]) / 0.004)) ** (1 / 3)
    assert longest == pytest.approx(float(np.clip(np.median(flights), 0.01, 0.1)), rel=1e-3)
    # A gap that flight alone explains has no other summit.
    assert effect.other_optima(now, joint, (large, 0.1, 0.0, 0.0, 0.03), np.array([small / 2])) == ()
