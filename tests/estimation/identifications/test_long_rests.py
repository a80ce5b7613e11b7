"""Logs in which the robot rests for most of the time."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from estimation import identify
from robots.plants import nominal_plant, simulate
from robots.signals import Log, Motion
from tests.estimation.predictions.test_simulability import motion
from tests.oed.campaigns.conftest import arm


def from_rest(whole: Motion) -> Motion:
    """The motion with a smooth start: for two seconds it grows from nothing."""
    share = np.clip(whole.t / 2.0, 0.0, 1.0)
    spline = CubicSpline(whole.t, whole.q * (share**3 * (10 - 15 * share + 6 * share**2))[:, None])
    return Motion(whole.t, *(np.asarray(spline(whole.t, order)) for order in range(3)))


@pytest.mark.slow
@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_rests_before_the_motion_change_little(noise: float) -> None:
    """A rest of three times the motion is no obstacle, even with a constant torque: parameters stay within errors."""
    robot = arm()
    plant, planned = nominal_plant(robot), from_rest(motion())
    moving = simulate(plant, planned, seed=1)
    assert moving.tau is not None
    rows, still = 3 * len(moving), np.zeros((1, 2))
    rest = np.repeat(moving.q[:1], rows, axis=0)
    held = plant.model.torque(planned.q[:1], still, still, plant.parameters)
    held = held + noise * np.random.default_rng(2).standard_normal((rows, 2))
    t = 0.004 * np.arange(rows + len(moving))
    log = Log(t=t, q=np.concatenate([rest, moving.q]), tau=np.concatenate([held, moving.tau]))
    alone = identify(robot, [moving], friction="coulomb-viscous").model
    whole = identify(robot, [log], friction="coulomb-viscous").model
    assert whole.names == alone.names
    inertial = np.array([column.term == "rigid_body" for column in alone.parameters])
    away = np.abs(whole.values - alone.values)[inertial]
    # Both see the same motion. What they smooth differently moves parameters by less than their errors.
    assert (away < 3.0 * alone.standard_errors[inertial]).all()
