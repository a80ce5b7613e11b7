"""Tests of a sudden tilt of the base and a sudden change of a joint zero, against pinocchio."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimation.models.extension import find_effect
from robots.robot import Robot
from robots.signals import Motion
from robots.terms.discrepancies.offset_step import BaseStep, ZeroStep
from robots.terms.discrepancies.patterns import is_of_time
from robots.terms.effects import Situation

WHEN = 104.0  # [s], in the middle of the motion


@pytest.mark.parametrize("moved", ["base", "zero"])
def test_its_torque_is_what_pinocchio_says_changes_at_a_moment(
    swept: Situation, pinocchio_torque: Callable[..., np.ndarray], moved: str
) -> None:
    """The columns are zero before the change; afterwards they give pinocchio's torque difference."""
    motion = Motion(swept.t, swept.q, swept.dq, swept.ddq)
    angle = 5e-4
    if moved == "base":
        c, s = np.cos(angle), np.sin(angle)
        gravity = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]) @ np.asarray(swept.robot.chain.gravity)
        changed = pinocchio_torque(swept.robot, motion, gravity)
        X = BaseStep().columns(swept, None, (WHEN,))
    else:
        q = swept.q + angle * np.eye(6)[2]
        changed = pinocchio_torque(swept.robot, Motion(swept.t, q, swept.dq, swept.ddq))
        X = ZeroStep().columns(swept, 3, (WHEN,))
    extra = changed - pinocchio_torque(swept.robot, motion)
    after = swept.t >= WHEN
    assert not X[~after].any()
    values = np.linalg.lstsq(X[after].reshape(-1, X.shape[2]), extra[after].ravel(), rcond=None)[0]
    assert np.linalg.norm(values) == pytest.approx(angle, rel=1e-3)
    np.testing.assert_allclose(X[after] @ values, extra[after], atol=2e-3 * np.abs(extra).max())


@pytest.mark.parametrize(("effect", "joint"), [(BaseStep(), None), (ZeroStep(), 3)])
def test_its_moment_is_proposed_out_of_noise(swept: Situation, effect: BaseStep | ZeroStep, joint: int | None) -> None:
    """With noise as large as the change, one of six proposals is within 2 % of the data of the true time."""
    change = effect.columns(swept, joint, (WHEN,)).sum(axis=2)
    size = np.sqrt(np.mean(change**2, axis=0)) + 1e-3 * np.abs(change).max()
    noise = np.random.default_rng(0).standard_normal(change.shape) * size
    proposed = effect.propose(swept, joint, (change + noise) / size**2, 6)
    assert len(proposed) == 6
    assert min(abs(moment - WHEN) for (moment,) in proposed) < 0.02 * (swept.t[-1] - swept.t[0])


def test_they_are_found_by_their_names_and_are_causes_of_their_own(arm: Robot, swept: Situation) -> None:
    """Both effects are found by name, and are changes with time."""
    for effect in (BaseStep(), ZeroStep()):
        assert type(find_effect(effect.name)) is type(effect)
        assert is_of_time(effect)
        assert len(effect.grid(swept, 1)) > 10
    assert BaseStep().joints(arm) == (None,)
    assert BaseStep().joints(replace(arm, chain=replace(arm.chain, gravity=(0.0, 0.0, 0.0)))) == ()
    assert "0.29 deg at t = 104.00 s" in BaseStep().describe(None, np.array([0.003, 0.004]), (WHEN,))
    assert "joint 2 that stands -0.03 rad" in ZeroStep().describe(2, np.array([-0.03]), (WHEN,))
