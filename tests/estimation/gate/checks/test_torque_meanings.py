"""Specification of the meaning of torque columns: named, with the option that mends it."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from estimation import diagnose, identify
from estimation.gate import check_log
from estimation.regressions.torque_meanings import as_joint_torque
from robots.common.errors import InputError
from robots.plants import Sensors, nominal_plant, simulate
from tests.estimation.gate.findings_of import found

BENCHMARKS = Path(__file__).parents[4] / "benchmarks"
OPTIONS = {"friction": "coulomb-viscous", "position": False}


@pytest.fixture(scope="module")
def columns():
    """The benchmark of the same subject."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCHMARKS))
        import torque_columns

        yield torque_columns


@pytest.mark.slow
@pytest.mark.parametrize("name", ["er3a", "planar arm"])
@pytest.mark.parametrize(
    "kind", ["right", "current", "motor", "gravity of the description compensated", "target", "external", "filtered"]
)
def test_each_kind_is_named(columns, name, kind):
    """One seed of the benchmark on two robots, descriptions 20 % off: fixed logs, no chance."""
    (trial,) = columns.trials((name,), (kind,), range(1))
    assert trial.right, trial.said


@pytest.fixture(scope="module")
def log_of(arm, fourier_motion):
    """Simulate the arm as described, with 2 % noise."""

    def build(seed):
        plant = nominal_plant(arm, friction="coulomb-viscous", sensors=Sensors())
        return simulate(plant, fourier_motion(arm, seed), seed=seed)

    return build


def still(arm, log):
    """Gives the described gravity."""
    plant = nominal_plant(replace(arm, friction=np.zeros((2, 4))), sensors=Sensors(torque_noise=0.0))
    zero = np.zeros_like(log.q)
    return plant.model.torque(log.q, zero, zero, plant.parameters)


@pytest.mark.slow
@pytest.mark.parametrize("meaning", ["without-gravity", "motor:2", "current"])
@pytest.mark.parametrize("seed", [1])
def test_the_option_in_the_advice_leads_to_the_right_fit(arm, log_of, meaning, seed):
    """The converted log gives the parameters of the right one, and has no finding; diagnose takes it, too."""
    log = log_of(seed)
    tau = np.array(log.tau)
    if meaning == "without-gravity":
        tau -= still(arm, log)
    elif meaning == "motor:2":
        tau[:, 1] /= arm.gear_ratio[1]
    else:
        tau /= np.abs(arm.torque_constant)
    robot = replace(arm, torque_constant=np.abs(arm.torque_constant))
    wrong = replace(log, tau=tau)
    (finding,) = found(check_log(robot, wrong), "torque_meaning")
    assert re.search(r"--torque-is ([-a-z:0-9,]+)", finding.action)[1] == meaning
    mended = replace(wrong, metadata={"torque_is": meaning})
    assert check_log(robot, mended).findings == ()
    right, again = identify(robot, log, **OPTIONS), identify(robot, mended, **OPTIONS)
    # The encoder's steps are all that differs.
    np.testing.assert_allclose(again.model.values, right.model.values, rtol=0.02, atol=0.01)
    if meaning == "without-gravity" and seed == 1:
        assert diagnose(robot, [mended], candidates=["stribeck"], friction="coulomb-viscous").verdict


@pytest.mark.slow
@pytest.mark.parametrize("factors", [(3.0, 3.0), (20.0, 4.0), (7.0, 18.0)])
def test_unknown_torque_constants_are_estimated(arm, log_of, factors):
    """Currents without a described constant become torques as accurate as the description: here within 3 %."""
    log = log_of(3)
    unknown = replace(arm, torque_constant=np.full(2, np.nan))
    converted = as_joint_torque(unknown, replace(log, tau=log.tau / factors), "current")
    ratio = np.einsum("tj,tj->j", converted.tau, log.tau) / np.einsum("tj,tj->j", log.tau, log.tau)
    np.testing.assert_allclose(ratio, 1.0, rtol=0.03)
    assert converted.metadata["torque_was"] == "current"


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.0, 1.0])
def test_small_torques_without_friction_may_be_external_ones(arm, fourier_motion, friction):
    """A twelfth of the described torque is a current if friction is in it, and else may be what a controller left."""
    real = replace(arm, friction=friction * arm.friction)
    plant = nominal_plant(real, friction="coulomb-viscous", sensors=Sensors())
    log = simulate(plant, fourier_motion(arm, 1), seed=1)
    (finding,) = found(check_log(arm, replace(log, tau=log.tau / 12)), "torque_meaning")
    assert "currents" in finding.text
    assert ("external torques" in finding.text) == (friction == 0)


def test_what_cannot_be_converted_is_refused(arm, log_of):
    """An unknown meaning, a joint that is not there, and a description without gears or links."""
    log = log_of(1)
    for text in ("amperes", "motor:3", "motor:x", "current:0"):
        with pytest.raises(InputError, match="current, motor, without-gravity"):
            as_joint_torque(arm, log, text)
    with pytest.raises(InputError, match="no gear ratio"):
        as_joint_torque(replace(arm, gear_ratio=np.ones(2)), log, "motor")
    with pytest.raises(InputError, match="needs the links"):
        as_joint_torque(replace(arm, inertia=np.full((2, 10), np.nan)), log, "without-gravity")
    with pytest.raises(InputError, match="no torque columns"):
        as_joint_torque(arm, replace(log, tau=None), "motor")
    assert as_joint_torque(arm, log) is log


@pytest.mark.slow
def test_a_description_that_is_far_off_is_reported_beside_a_good_fit(arm, log_of):
    """Described torques of ten times the measured ones are a warning, whatever else is said."""
    heavy = replace(arm, inertia=10 * arm.inertia)
    names = {finding.name for finding in check_log(heavy, log_of(1)).findings}
    assert names & {"torque_meaning", "nominal_error"}
