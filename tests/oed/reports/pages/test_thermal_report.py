"""The page of friction and heat, of a fit whose truth is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from estimation.thermal import ThermalEstimate, ThermalRun, choose_thermal, fit_thermal
from oed.reports import to_plotly
from oed.reports.pages.thermal_report import _models
from oed.reports.pictures.thermal_pictures import (
    duty_picture,
    duty_runs,
    friction_curves_picture,
    friction_time_picture,
    time_constant_picture,
)
from robots.signals import Log
from robots.thermal import SecondOrder

TRUTH = SecondOrder(alpha=-0.0141, beta=1.0, K1=4.41, K2=4.57, C1=737.61, C2=9163.45)


def heated() -> ThermalRun:
    """Two hours on one clock: an hour at 60 W, a rest of twenty minutes, forty minutes at 25 W; 1 % of noise."""
    t = np.arange(0.0, 7200.0, 20.0)
    power = np.where(t < 3600.0, 60.0, np.where(t < 4800.0, 0.0, 25.0))
    T = TRUTH.temperatures(power[:-1], np.diff(t))[:, 0]
    noise = 1.0 + 0.01 * np.random.default_rng(0).standard_normal(len(t))
    return ThermalRun(t=t, power=power, friction=TRUTH.friction_factor(T) * noise, cold_friction=1.0, name="run 1")


@pytest.fixture(scope="module")
def fit() -> ThermalEstimate:
    """The second-order model, from cold."""
    return fit_thermal(heated(), order="second", start="ambient", starts=1)


def logs() -> list[Log]:
    """Logs that say of themselves at which duty cycle they are, and one that says nothing."""
    q = np.zeros((2, 1))
    reported = [(0.0, 1, 1.0), (3000.0, 1, 1.0), (4800.0, 2, 0.4)]
    named = [Log(t=np.array([t, t + 590.0]), q=q, metadata={"run": run, "duty": duty}) for t, run, duty in reported]
    return [*named, Log(t=np.array([9000.0, 9001.0]), q=q)]


def test_duty_runs_are_read_off_the_logs() -> None:
    """Logs of one run and duty cycle are one run from its first sample to its last; others do not count."""
    found = [(run.label, run.start, run.end) for run in duty_runs(logs())]
    assert found == [("100 %", 0.0, 3590.0), ("40 %", 4800.0, 5390.0)]
    assert duty_runs([replace(log, metadata={}) for log in logs()]) == ()


@pytest.mark.slow
def test_each_duty_cycle_has_its_own_curve_from_zero(fit: ThermalEstimate) -> None:
    """Two runs are points and lines from minute zero on; a single one is no comparison."""
    picture = duty_picture(fit, duty_runs(logs()), title="joint 1")
    assert picture is not None
    series = picture.panels[0].series
    assert [s.name for s in series if s.kind == "lines"] == ["100 %", "40 %"]
    assert all(s.x[0] < 0.5 for s in series)
    assert duty_picture(fit, duty_runs(logs())[:1], title="joint 1") is None


def test_friction_is_shown_measured_and_predicted(fit: ThermalEstimate) -> None:
    """A joint that moves has points and a line; one that does not says so."""
    picture = friction_time_picture([fit, None], joint_names=("a", "b"))
    measured, predicted = picture.panels[0].series
    np.testing.assert_allclose(predicted.y[0], 1.0, atol=0.03)
    assert len(measured.x) == len(heated().t)
    assert picture.panels[1].note == "does not move"
    to_plotly(picture)


def test_time_constants_fall_with_power_and_agree_with_the_truth(fit: ThermalEstimate) -> None:
    """Curves are those of the true model within the intervals at the powers of the data (thesis Fig. 25)."""
    series = time_constant_picture([fit]).panels[0].series
    curves = [s for s in series if s.kind == "lines"]
    points = [s for s in series if s.kind == "markers"]
    assert [s.name for s in curves] == ["slow", "fast"]
    assert all(np.all(np.diff(s.y) < 0.0) for s in curves)
    slow = points[0]
    truth = TRUTH.time_constants(slow.x)[:, 0] / 60.0
    assert slow.error is not None
    # Twice the 95 % interval: by chance once in ten thousand.
    assert np.all(np.abs(slow.y - truth) < 2.0 * slow.error)
    to_plotly(time_constant_picture([fit]))


def test_friction_curves_go_from_cold_to_warm(fit: ThermalEstimate) -> None:
    """The first curve is the friction at T0, the last that of the warmest moment, 40 % lower (thesis Fig. 14)."""
    coefficients = np.array([[10.0, 5.0, 0.0, 0.0]])
    panel = friction_curves_picture([fit], coefficients, np.array([2.0])).panels[0]
    cold, warm = panel.series[0], panel.series[-1]
    assert (cold.name, warm.name) == ("coldest", "warmest")
    np.testing.assert_allclose(cold.y, 10.0 + 5.0 * cold.x, rtol=0.02)
    W = heated().power
    assert W is not None
    least = TRUTH.friction_factor(TRUTH.temperatures(W[:-1], 20.0)[:, 0]).min()
    np.testing.assert_allclose(warm.y / cold.y, least, rtol=0.03)


@pytest.mark.slow
def test_models_stand_beside_each_other() -> None:
    """The table has a row per model with its held-out error, and marks the chosen one."""
    choice = choose_thermal(heated(), orders=("first", "second"), start="ambient", starts=1)
    table = _models(choice, 4)
    assert [row[0] for row in table.rows] == ["first", "second (chosen)"]
    assert float(table.rows[1][1]) < float(table.rows[0][1])  # type: ignore[arg-type]
    assert "joint 4" in table.caption
