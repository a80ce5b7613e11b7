"""Test of load-dependent effects on a joint with an unknown rotor."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from estimation.diagnosis import diagnose
from robots.plants import simulate
from robots.robot import Robot

SHARE = 0.08


@pytest.mark.slow
def test_friction_by_the_load_tells_the_rotor_that_loads_no_gear(
    arm: Robot, arm_plant: Callable, fourier_motion: Callable, pinocchio_torque: Callable
) -> None:
    """Load-dependent friction determines the first joint's rotor, which is in one base parameter with its link.

    The load is pinocchio's. The chance that one of two 95 % intervals misses the true value is 10 %, so the seed is
    fixed.
    """
    motion = fourier_motion(arm, 0)
    log = simulate(arm_plant(torque_noise=0.01), motion, seed=0)
    load = pinocchio_torque(arm, motion)[:, 0]
    tau = log.tau.copy()
    tau[:, 0] += SHARE * np.abs(load) * np.sign(motion.dq[:, 0])
    bare = replace(arm, rotor_inertia=np.zeros(2))
    candidates = ("load_dependent_friction", "position_dependent_friction", "spring", "torque_constant_saturation")
    result = diagnose(bare, replace(log, tau=tau), candidates=candidates, friction="coulomb-viscous")
    (finding,) = result.findings
    assert (finding.effect, finding.joint) == ("load_dependent_friction", 1)
    reported = {parameter.name: parameter for parameter in finding.parameters}
    for name, truth in (("coulomb_per_load", SHARE), ("rotor_inertia", arm.rotor_inertia[0])):
        low, high = reported[name].ci95
        assert low < truth < high
    assert reported["rotor_inertia"].value == pytest.approx(0.2, rel=0.2)
    # A described rotor counts as known.
    known = diagnose(arm, replace(log, tau=tau), candidates=candidates, friction="coulomb-viscous").findings
    assert [(f.effect, f.joint) for f in known] == [("load_dependent_friction", 1)]
    assert {p.name: p.value for p in known[0].parameters}["rotor_inertia"] == 0.0
