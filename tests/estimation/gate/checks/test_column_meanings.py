"""Specification: what the columns mean is asked before anything is said of their values."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from estimation.gate import check_log
from estimation.recordings.rows.held_values import between_updates, find_updates
from robots.geometry.chain import Joint
from robots.plants import Sensors, nominal_plant, simulate
from tests.estimation.gate.findings_of import found

AXES = (("turn", "revolute"), ("lift", "prismatic"))


@pytest.mark.parametrize("rate", [25, 50])
def test_degrees_at_a_low_rate_are_degrees(er3a, good, rate):
    """A step of more than pi in degrees is no wrapped angle: positions in degrees are all that is said of them."""
    log = good(duration=20.0)
    log = log.rows(np.arange(0, len(log), 250 // rate))
    report = check_log(er3a, replace(log, q=np.rad2deg(log.q)))
    assert [finding.name for finding in report.of("refuse")] == ["unit_of_position"]
    assert "in degrees" in report.findings[0].text


@pytest.mark.parametrize("counts", [4096 / (2 * np.pi), 101 * 2**17 / (2 * np.pi)], ids=["joint", "motor"])
def test_counts_of_an_encoder_are_named(er3a, good, counts):
    """Whole numbers far beyond the limits are counts; they are no impossible values and no wraps."""
    log = good()
    report = check_log(er3a, replace(log, q=np.round(counts * log.q + 2048)))
    assert [finding.name for finding in report.of("refuse")] == ["unit_of_position"]
    assert "counts of an encoder" in report.findings[0].text


def test_percent_of_the_range_is_told_from_degrees(er3a, good):
    """Positions from -100 to 100 are inside the limits as degrees, too. The torques decide, and the advice mends."""
    log, limits = good(), er3a.limits
    q = 200 * (log.q - limits.lower) / (limits.upper - limits.lower) - 100
    (finding,) = check_log(er3a, replace(log, q=q)).of("refuse")
    assert "percent of each joint's range" in finding.text
    lists = re.findall(r"\[([^\]]+)\]", finding.action)
    scale, offset = (np.array([float(number) for number in one.split(",")]) for one in lists)
    np.testing.assert_allclose(q * scale + offset, log.q, atol=1e-3)
    assert "in degrees" in check_log(er3a, replace(log, q=np.rad2deg(log.q))).findings[0].text


def test_rows_with_closed_brakes_do_not_count(er3a, good):
    """An arm that stands on its brakes has torques of zero: they are named, and change no meaning."""
    log, rows = good(), 4000
    still = np.repeat(log.q[:1], rows, axis=0)
    t = np.concatenate([log.t, log.t[-1] + 0.004 * np.arange(1, rows + 1)])
    q, tau = np.concatenate([still, log.q]), np.concatenate([np.zeros((rows, er3a.n)), log.tau])
    report = check_log(er3a, replace(log, t=t, q=q, tau=tau))
    assert not report.refused
    assert not {finding.name for finding in report.of("warning")} & {"torque_meaning", "unit_of_torque", "delay"}
    (finding,) = found(report, "unloaded_rest")
    assert "joints 2" in finding.text or "joint 2" in finding.text
    assert "to 16 s" in finding.text


def test_a_torque_that_is_held_is_named_and_interpolated(er3a, good):
    """A staircase is no delay: each value belongs to the row in which it comes."""
    log, hold = good(), 5
    held = log.tau[np.arange(len(log)) // hold * hold]
    report = check_log(er3a, replace(log, tau=held))
    (finding,) = found(report, "held_torque")
    assert finding.value == hold
    assert not found(report, "delay")
    mended = report.corrected(replace(log, tau=held)).tau
    np.testing.assert_array_equal(mended[::hold], log.tau[::hold])
    # The motion is slow beside the updates: what is left is noise, and less than the steps were.
    assert np.std(mended - log.tau) < 0.75 * np.std(held - log.tau)


def test_a_coarse_torque_is_not_held(good):
    """A torque in coarse steps repeats as well, but not in every k-th row."""
    from estimation.recordings.rows.columns import Columns

    log = good()
    coarse = replace(log, tau=np.round(log.tau))
    assert not len(find_updates(Columns.of(coarse)))
    assert between_updates(coarse, find_updates(Columns.of(coarse))) is coarse


@pytest.mark.slow
@pytest.mark.parametrize("lead", [1.0, -2.0])
def test_a_slide_on_a_screw_is_named_with_its_lead(arm, fourier_motion, lead):
    """The reading of a slide that contains the angle of a joint: the factor in the advice is right to 5 %."""
    axes = [Joint(name, kind, np.eye(3), np.zeros(3), (0.0, 0.0, 1.0)) for name, kind in AXES]
    robot = replace(arm, chain=replace(arm.chain, joints=tuple(axes)))
    plant = nominal_plant(robot, friction="coulomb-viscous", sensors=Sensors())
    log = simulate(plant, fourier_motion(robot, 1), seed=1)
    factor = lead / (2 * np.pi)
    read = replace(log, q=log.q @ np.array([[1.0, 0.0], [factor, 1.0]]).T)
    (finding,) = found(check_log(robot, read), "coupled_axes")
    stated = float(re.search(r"coupling: \{2: \{1: ([-\d.e]+)\}\}", finding.action)[1])
    assert stated == pytest.approx(factor, rel=0.05)
