"""Specification of consequences: what a cause explains is not printed beside it, and what it does not explain stays."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from estimation.gate.checks.excitation import excitation
from tests.estimation.gate.findings_of import found, joints


@pytest.mark.slow
def test_a_wrong_unit_at_one_joint_is_all_that_is_said(good, spoilt):
    """If a torque is a hundredth of what it was, nothing is said of the joints that share its links."""
    tau = np.array(good().tau)
    tau[:, 0] /= 100
    report = spoilt(tau=tau)
    assert (np.delete(report.unexplained, 0) > 0.3).any()
    assert {finding.name for finding in report.findings} <= {"torque_meaning", "unit_of_torque"}
    assert {finding.joint for finding in report.findings} <= {1, None}
    assert found(report, "torque_meaning")


@pytest.mark.slow
def test_a_wrong_unit_does_not_hide_a_torque_of_noise(good, spoilt):
    """A joint that the cause does not explain is reported beside it."""
    tau = np.array(good().tau)
    tau[:, 0] /= 100
    tau[:, 5] = np.random.default_rng(0).normal(size=len(tau))
    report = spoilt(tau=tau)
    assert found(report, "torque_meaning")
    assert joints(report, "badly_excited") == [6]


@pytest.mark.slow
def test_an_inverted_torque_is_all_that_is_said(good, spoilt):
    """The fits of the other joints, which share its links, are no findings of their own."""
    report = spoilt(tau=good().tau * np.array([1, 1, -1, 1, 1, 1]))
    assert [finding.name for finding in report.findings] == ["torque_sign"]
    assert report.refused


@pytest.mark.parametrize(("information", "name"), [(7.2, "badly_excited"), (140.4, "poorly_explained")])
@pytest.mark.parametrize("others", [True, False])
def test_an_excited_joint_is_not_called_badly_excited(er3a, information, name, others):
    """A torque worse than a constant, with inertia or friction beyond doubt, is poorly explained and not badly excited.

    If no joint is explained, the log is refused in both cases.
    """
    errors = np.array([1.03] + 5 * [0.1 if others else 1.2])
    fitted = SimpleNamespace(physics=6 * [SimpleNamespace(information=information)], unexplained=errors)
    cleaned = SimpleNamespace(columns=SimpleNamespace(prefix="tau"))
    findings = excitation(SimpleNamespace(robot=er3a, fitted=fitted, cleaned=cleaned))
    assert {finding.name for finding in findings} == {name}
    assert [finding.joint for finding in findings] == ([1] if others else [1, 2, 3, 4, 5, 6])
    assert {finding.severity for finding in findings} == {"warning" if others else "refuse"}
    assert ("7.2 standard errors" in findings[0].text) == (name == "badly_excited")
