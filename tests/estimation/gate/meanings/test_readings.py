"""Specification of readings: one mapping is named for all that is wrong with the columns, and it mends the log."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from estimation import read_log, write_log
from estimation.gate import check_log
from robots.plants import Sensors, nominal_plant, simulate
from robots.terms.effects.joint_coupling import JointCoupling
from tests.estimation.gate.findings_of import found


def other_names(log, order):
    return replace(log, q=log.q[:, order], tau=log.tau[:, order])


def turned(log, joint, *, q=True):
    sign = np.where(np.arange(log.n) == joint, -1.0, 1.0)
    return replace(log, q=log.q * sign if q else log.q, tau=log.tau * sign)


def times(log, joint, factor):
    return replace(log, tau=log.tau * np.where(np.arange(log.n) == joint, factor, 1.0))


WRONG = {
    "two heavy joints exchanged": (lambda log: other_names(log, [0, 2, 1, 3, 4, 5]), "swapped_columns"),
    "a heavy and a light joint exchanged": (lambda log: other_names(log, [4, 1, 2, 3, 0, 5]), "swapped_columns"),
    "exchanged, and one torque inverted": (
        lambda log: turned(other_names(log, [0, 2, 1, 3, 4, 5]), 0, q=False),
        "swapped_columns",
    ),
    "a joint counted the other way": (lambda log: turned(log, 2), "position_sign"),
    "one torque in mN m": (lambda log: times(log, 1, 1000.0), "torque_meaning"),
    "one torque in mN m, two joints exchanged": (
        lambda log: times(other_names(log, [0, 2, 1, 3, 4, 5]), 0, 1000.0),
        "swapped_columns",
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("case", WRONG)
def test_the_mapping_in_the_advice_gives_the_log_back(er3a, good, case, tmp_path):
    """Each finding states the whole mapping; read with it, the log has no finding."""
    log = good()
    spoil, name = WRONG[case]
    wrong = spoil(log)
    report = check_log(er3a, wrong)
    assert found(report, name)
    assert report.refused or name == "torque_meaning"
    mappings = {tuple(re.findall(r"`([a-z_]+: [^`]+)`", one.action)) for one in report.findings}
    (mapping,) = mappings
    (tmp_path / "mapping.yaml").write_text("\n".join(mapping))
    write_log(tmp_path / "log.csv", wrong)
    mended = read_log(tmp_path / "log.csv", mapping=tmp_path / "mapping.yaml")
    np.testing.assert_allclose(mended.q, log.q, atol=1e-9)
    np.testing.assert_allclose(mended.tau, log.tau, rtol=1e-6, atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("part", ["whole", "half"])
def test_a_coupled_wrist_is_no_wrong_column(er3a, fourier_motion, part):
    """Drives of the wrist that turn together are an effect that the model lacks: the log is usable as it is."""
    motion = fourier_motion(er3a, 4)
    plant = nominal_plant(er3a, friction="coulomb-viscous", sensors=Sensors())
    log = simulate(plant, motion, seed=4)
    size = 6.0 * np.asarray(er3a.friction)[4:, :2].max(axis=0)
    together = motion.dq[:, 4] + motion.dq[:, 5]
    tau = np.array(log.tau)
    tau[:, 4:] += (size[0] * np.tanh(together / 1e-2) + size[1] * together)[:, None]
    log = replace(log, tau=tau)
    log = log if part == "whole" else log.rows(slice(0, len(log) // 2))
    report = check_log(er3a, log)
    assert not report.refused
    (finding,) = found(report, "coupled_axes")
    assert JointCoupling.name in finding.text


@pytest.mark.slow
def test_a_label_without_a_trace_passes(er3a, good):
    """The links of the wrist are balanced about joint 4: counted the other way, it moves alike, and nothing is said."""
    assert check_log(er3a, turned(good(), 3)).findings == ()
