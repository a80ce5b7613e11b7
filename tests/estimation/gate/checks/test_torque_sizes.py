"""Specification: torques are compared with those of the description only if it predicts any."""

from __future__ import annotations

from dataclasses import replace

from estimation.gate import Context
from estimation.gate.checks.torque_sizes import TorqueSizes


def test_no_comparison_with_a_torque_of_zero(er3a, good):
    """A joint on a vertical axis that does not accelerate needs no torque: nothing is 20 times as large."""
    log = good()
    findings = TorqueSizes().run(Context(er3a, replace(log, t=1e9 * log.t)))
    assert all(finding.joint != 1 for finding in findings)
    assert all(finding.value == finding.value for finding in findings)


def test_torques_of_the_motors_have_the_factor_of_the_gear(er3a, good):
    """A torque divided by the gear ratio is named as the motor's, and its factor is that of the gear."""
    log = good()
    findings = TorqueSizes().run(Context(er3a, replace(log, tau=log.tau / er3a.gear_ratio)))
    factors = {finding.joint: finding.value * er3a.gear_ratio[finding.joint - 1] for finding in findings}
    assert all("motor torque" in finding.text for finding in findings)
    # Joint 2 carries the arm: rotor inertia, which the comparison leaves out, is small beside its weight.
    assert abs(factors[2] - 1.0) < 0.1
