"""The data of an animation: frames, shares of limits in use, path, and closest approaches."""

from __future__ import annotations

import json

import numpy as np
import pytest

from oed.reports import animate
from oed.reports.animations.building import FRAMES
from robots.common.errors import InputError
from robots.geometry.chain import Chain, Joint
from robots.limits import Limits
from robots.robot import Robot
from robots.signals import Log, Motion

TWO = np.ones(2)


def robot(**limits) -> Robot:
    joints = (
        Joint("lift", "prismatic", np.eye(3), np.array([0, 0, 0.3])),
        Joint("swing", "revolute", np.eye(3), np.array([0.2, 0, 0]), np.array([0, 1.0, 0])),
    )
    bounds = {"velocity": 2 * TWO, "acceleration": 10 * TWO, "jerk": np.inf * TWO, "torque": np.inf * TWO, **limits}
    tip = np.eye(4)
    tip[0, 3] = 0.5
    return Robot(name="two", chain=Chain(joints, tip=tip), limits=Limits(lower=-TWO, upper=3 * TWO, **bounds))


def motion(duration: float = 4.0, period: float = 0.004) -> Motion:
    t = period * np.arange(round(duration / period) + 1)
    s, c = np.sin(2 * t)[:, None], np.cos(2 * t)[:, None]
    return Motion(t, s * [0.5, 0.9], 2 * c * [0.5, 0.9], -4 * s * [0.5, 0.9])


def test_shares_are_those_of_the_margins() -> None:
    """The largest share of each limit is one minus the margin's slack; a limit that is not there has no share."""
    described, played = robot(acceleration=np.array([10.0, np.inf])), motion()
    found = animate(described, played)
    assert found.quantities == ("position", "velocity", "acceleration")
    margins = described.limits.margins(played)
    for name in ("velocity", "acceleration"):
        wanted = [1 - m.slack_fraction if np.isfinite(m.limit) else np.nan for m in margins if m.quantity == name]
        np.testing.assert_allclose(found.shares[name].max(axis=0), wanted, rtol=1e-12)
    ends = [1 - m.slack_fraction for m in margins if m.quantity in ("lower", "upper")]
    np.testing.assert_allclose(found.shares["position"].max(axis=0), np.maximum(ends[:2], ends[2:]), rtol=1e-12)
    assert np.isnan(found.shares["acceleration"][:, 1]).all()


def test_peaks_between_frames_count() -> None:
    """A velocity of one sample shows in the next frame, though no frame is at that sample."""
    played = motion()
    dq = np.array(played.dq)
    dq[501, 0] = 1.9
    found = animate(robot(), Motion(played.t, played.q, dq, played.ddq))
    frame = np.searchsorted(found.t, played.t[501])
    assert found.t[frame] != played.t[501]
    assert found.shares["velocity"][frame, 0] == pytest.approx(0.95)


def test_path_is_the_flange() -> None:
    """The path is that of the flange, by geometry: a lift of 0.3 m + q1, and an arm of 0.5 m that swings about y."""
    found = animate(robot(), motion())
    q1, q2 = found.q.T
    np.testing.assert_allclose(found.path[:, 0], 0.2 + 0.5 * np.cos(q2), atol=1e-12)
    np.testing.assert_allclose(found.path[:, 2], 0.3 + q1 - 0.5 * np.sin(q2), atol=1e-12)


def test_long_motions_have_few_frames() -> None:
    """An hour has as many frames as a page can hold, with the first and the last row among them."""
    t = np.arange(0.0, 3600.0, 0.1)
    q = np.sin(0.1 * t)[:, None] * TWO
    played = Motion(t, q, np.zeros_like(q), np.zeros_like(q))
    found = animate(robot(), played)
    assert len(found.t) <= FRAMES
    assert (found.t[0], found.t[-1]) == (t[0], t[-1])
    assert len(found.to_json()) < 200_000


def test_logs_are_smoothed() -> None:
    """Encoder steps of 1e-4 rad leave the acceleration of a log near that of its motion; its torque is the log's."""
    played = motion()
    log = Log(played.t, np.round(played.q, 4), tau=np.full_like(played.q, 5.0))
    found = animate(robot(torque=10 * TWO), log)
    assert found.source == "log"
    np.testing.assert_allclose(found.shares["torque"], 0.5)
    inner = slice(10, -10)
    # The low pass at 6 Hz passes 0.3 Hz; differentiating the steps twice without it would give 100 rad/s2.
    wanted = 0.4 * np.abs(np.sin(2 * found.t[inner]))[:, None] * [0.5, 0.9]
    np.testing.assert_allclose(found.shares["acceleration"][inner], wanted, atol=0.03)
    assert "jerk" not in {margin.quantity for margin in found.approaches}


def test_data_are_json() -> None:
    """The data for the page are JSON without NaN, and cannot end a script element."""
    found = animate(robot(velocity=np.array([np.inf, 2.0])), motion(), marks={2: "</script><b>"})
    text = found.to_json()
    data = json.loads(text)
    assert "<" not in text
    assert data["marks"] == {"2": "</script><b>"}
    assert data["shares"]["velocity"][0] is None
    assert len(data["q"]) == 2 * len(data["t"])
    assert "Joint 2 is marked" in found.summary()


def test_other_robots_are_refused() -> None:
    """A motion of another number of joints names both."""
    played = motion()
    one = Motion(played.t, *(values[:, :1] for values in (played.q, played.dq, played.ddq)))
    with pytest.raises(InputError, match="1 joints, two has 2"):
        animate(robot(), one)
