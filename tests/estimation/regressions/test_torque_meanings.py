"""Currents of a robot whose description states no torque constants."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from estimation import identify, predict
from estimation.regressions.torque_meanings import as_joint_torque, with_torque_constants
from oed.cli.options.logs import TorqueMeaning
from robots.common.errors import AssumedValueWarning, InputError
from robots.loading import load_robot
from robots.plants import nominal_plant, simulate
from robots.signals import Motion
from tests.oed.cli.conftest import ROBOT

CONSTANTS = np.array([8.0, 3.0])
CURRENT = {"torque_is": "current"}


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    """Two links in a vertical plane."""
    path = tmp_path_factory.mktemp("robot") / "two.yaml"
    path.write_text(ROBOT.replace("VELOCITY", "2"))
    return load_robot(path)


def currents(robot, seed, payload=None):
    """Half a minute of three tones a joint, with currents in its torque columns; a point mass [kg] at 0.3 m."""
    rng = np.random.default_rng(seed)
    t, w = 0.004 * np.arange(7500), 2 * np.pi * np.array([[0.11, 0.27, 0.61], [0.17, 0.37, 0.53]])
    phase = rng.uniform(0, 6, w.shape)
    at = t[:, None, None] * w + phase
    q, dq, ddq = ((0.6 * x).sum(axis=2) for x in (np.sin(at) / w, np.cos(at), -np.sin(at) * w))
    inertia = np.array(robot.inertia)
    if payload is not None:
        inertia[-1] += payload * np.array([1.0, 0.3, 0, 0, 0, 0, 0, 0.09, 0, 0.09])
    log = simulate(
        nominal_plant(replace(robot, inertia=inertia, friction=0.1 * robot.friction), seed=1),
        Motion(t, q, dq, ddq),
        seed=seed,
    )
    return replace(log, tau=log.tau / CONSTANTS, metadata=CURRENT)


@pytest.mark.slow
def test_logs_of_one_robot_share_their_constants(robot):
    """One estimate serves both logs, and is said; the model keeps it, and predicts a log of currents with it."""
    logs = [currents(robot, 1), currents(robot, 2)]
    with pytest.warns(AssumedValueWarning, match="torque constants estimated"):
        known = with_torque_constants(robot, logs)
    np.testing.assert_allclose(known.torque_constant, CONSTANTS, rtol=0.02)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AssumedValueWarning)
        model = identify(robot, logs).model
    np.testing.assert_array_equal(model.robot.torque_constant, known.torque_constant)
    assert [entry["torque_was"] for entry in model.provenance["logs"]] == ["current", "current"]
    other = currents(robot, 3)
    assert (predict(model, other).nrmse < 0.1).all()
    with pytest.warns(AssumedValueWarning, match="state --torque-is"):
        assert (predict(model, replace(other, metadata={})).nrmse > 0.5).all()


@pytest.mark.slow
def test_a_payload_is_not_taken_for_a_constant(robot):
    """Constants are those of the log without the payload; the loaded log alone would hide a part of it in them."""
    loaded, free = currents(robot, 1, 0.5), currents(robot, 1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AssumedValueWarning)
        known, logs = TorqueMeaning().as_joint_torque(robot, [loaded, free], without=[free])
        alone = with_torque_constants(robot, [loaded])
    np.testing.assert_allclose(known.torque_constant, CONSTANTS, rtol=0.05)
    np.testing.assert_array_equal(logs[0].tau, loaded.tau * known.torque_constant)
    assert (alone.torque_constant < 0.9 * CONSTANTS).any()


def test_constants_that_no_log_shows_are_asked_for(robot):
    """Without an estimate the constant must be stated."""
    log = currents(robot, 1)
    with pytest.raises(InputError, match="states no torque constant"):
        as_joint_torque(robot, log, estimate=False)
    still = replace(log, q=np.zeros_like(log.q))
    with pytest.raises(InputError, match="states no torque constant"):
        as_joint_torque(with_torque_constants(robot, [still]), still, estimate=False)


def test_stated_constants_stay(robot):
    """What the description states is not estimated again."""
    stated = replace(robot, torque_constant=np.array([7.0, np.nan]))
    with pytest.warns(AssumedValueWarning):
        known = with_torque_constants(stated, [currents(robot, 1)])
    assert known.torque_constant[0] == 7.0
    assert known.torque_constant[1] == pytest.approx(3.0, rel=0.05)
    assert with_torque_constants(stated, [replace(currents(robot, 1), metadata={})]) is stated
