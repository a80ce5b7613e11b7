"""Tests of friction that differs between sessions: one finding for all joints, with a factor for each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimation import diagnose
from estimation.logs.clocks import on_one_clock
from estimation.models.extension import find_effect
from robots.robot import Robot
from robots.signals import Log
from robots.terms.discrepancies.patterns import Pattern, is_of_time
from robots.terms.discrepancies.session_friction import MOST_SESSIONS, SessionFriction
from robots.terms.effects import Situation
from robots.terms.situations.joining import join_situations

DAY = 86400.0


def _later(seen: Situation, by: float) -> Situation:
    """Returns the same motion at a later time, with a given friction."""
    return replace(seen, t=seen.t + by, friction=seen.q + 2.0, _cache={})


def test_each_session_has_shares_of_its_own(swept: Situation) -> None:
    """Each session after the first has a column per joint; a short pause does not begin a session."""
    days = join_situations([_later(swept, by) for by in (0.0, 30.0, DAY, 2 * DAY)])
    rows, n = len(swept), 6
    X = SessionFriction().columns(days, None).reshape(4 * rows, n, MOST_SESSIONS - 1, n)
    assert not X[: 2 * rows].any()
    assert not X[:, :, 2:].any()
    for k in (0, 1):
        part = X[(k + 2) * rows : (k + 3) * rows, :, k]
        np.testing.assert_allclose(np.einsum("tjj->tj", part), swept.q + 2.0)
        assert not part[:, ~np.eye(n, dtype=bool)].any()
    assert len(SessionFriction().grid(days, None)) == 1
    assert SessionFriction().grid(join_situations([swept, _later(swept, 30.0)]), None) == ()
    many = join_situations([_later(swept, k * DAY) for k in range(9)])
    assert SessionFriction().columns(many, None).any(axis=(0, 1)).sum() == (MOST_SESSIONS - 1) * n


def test_logs_whose_pauses_nobody_noted_may_be_of_several_days(swept: Situation) -> None:
    """Two logs whose clocks both start anew are two sessions, for any start time."""
    rng = np.random.default_rng(0)
    for start in rng.uniform(0.0, 1e4, 50):
        log = Log(t=swept.t + start, q=swept.q, tau=swept.q)
        first, second = on_one_clock([log, log])
        pair = join_situations([replace(swept, t=np.asarray(part.t), _cache={}) for part in (first, second)])
        assert SessionFriction().grid(pair, None) == ((),)


@pytest.mark.slow
def test_colder_gears_on_the_second_day_are_reported_once(arm: Robot, arm_log: Callable[..., Log]) -> None:
    """Friction that is 15 % higher on both joints in a second session is one unexplained finding of the robot."""
    first, second = arm_log(torque_noise=0.02), arm_log(seed=1, motion_seed=1, torque_noise=0.02)
    logs = [first, replace(second, t=second.t + DAY, tau=second.tau + 0.15 * _friction(arm, second))]
    found = diagnose(arm, logs, candidates=("friction_step", "load_dependent_friction"))
    assert found.verdict == "unexplained"
    finding = found.findings[0]
    assert (finding.pattern, finding.joint) == (SessionFriction.name, None)
    assert "% more than in the first" in finding.sentence
    reported = {p.name: p.value for p in finding.parameters}
    assert reported["share_2_of_joint_1"] == pytest.approx(0.15, abs=0.05)
    assert reported["share_2_of_joint_2"] == pytest.approx(0.15, abs=0.05)


def _friction(arm: Robot, log: Log) -> np.ndarray:
    """Evaluates Coulomb and viscous friction (N, 2) of the virtual arm from its description."""
    dq = np.gradient(log.q, log.t, axis=0)
    return arm.friction[:, 0] * np.sign(dq) + arm.friction[:, 1] * dq


def test_it_is_found_by_its_name_and_its_phases_do_not_last_for_days(swept: Situation) -> None:
    """The effect is found by its name; the frequency grids of oscillations depend on the recorded time only."""
    assert isinstance(find_effect(SessionFriction.name), SessionFriction)
    assert is_of_time(SessionFriction())
    days = join_situations([swept, _later(swept, DAY)])
    for kind in ("sway", "vibration"):
        assert len(Pattern(kind).grid(days, 1)) < 3 * max(len(Pattern(kind).grid(swept, 1)), 20)
