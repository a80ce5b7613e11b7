"""The quantities of a new monitor, with priors by the residual that the model states."""

from __future__ import annotations

import numpy as np

from estimation.monitoring.control_charts.charts import Chart
from estimation.monitoring.control_charts.level_filter import LevelFilter
from estimation.monitoring.control_charts.quantities import DIRECTION_SHARE, Group, Quantity
from estimation.monitoring.settings import MonitorSettings
from estimation.monitoring.windows.baseline import Baseline
from estimation.monitoring.windows.heat import HeatState
from estimation.monitoring.windows.projection import Window
from robots.common.arrays import Array


def initial_quantities(
    baseline: Baseline,
    heat: HeatState,
    settings: MonitorSettings,
    window: Window,
    payload: Array,
    run_length: float,
) -> list[Quantity]:
    """Makes the quantities: friction and offset of each joint, payload, what all share, residual of each joint.

    Args:
        baseline: the model.
        heat: what explains friction.
        settings: of the monitor.
        window: the first one.
        payload: its payload directions (N, n, p).
        run_length: windows between false alarms of each test.
    """
    n, found = baseline.robot.n, list[Quantity]()
    # A model without a stated residual errs by 5 % of the torque.
    residual = np.where(np.isfinite(baseline.residual), baseline.residual, 0.05 * window.torque_rms)
    residual = np.maximum(residual, 1e-6 * max(float(window.torque_rms.max()), 1e-9))

    def add(group: Group, index: int, mean: Array, spread: Array, scatter: float) -> None:
        # Besides friction: what is smaller than half of the model's own residual is no finding.
        margin = float(np.log1p(settings.smallest)) if group == "friction" else scatter
        chart = Chart(window=settings.window, run_length=run_length)
        found.append(Quantity(group, index, LevelFilter(mean, spread, scatter), chart, margin))

    mean, spread = heat.prior
    for j in range(n):
        add("friction", j, mean, spread, min(DIRECTION_SHARE * residual[j] / max(window.friction_rms[j], 1e-9), 0.3))
    zero, one = np.zeros(1), np.ones(1)
    for j in range(n):
        add("offset", j, zero, residual[j] * one, DIRECTION_SHARE * residual[j])
    level = float(np.sqrt(np.mean(residual**2)))
    for k in range(baseline.payload_count):
        size = level / max(float(np.sqrt(np.mean(payload[:, :, k] ** 2))), 1e-9)
        add("payload", k, zero, size * one, DIRECTION_SHARE * size)
    common = max(float(heat.common_spread[0]), 1e-9)
    add("common", 0, zero, common * one, DIRECTION_SHARE * common)
    for j in range(n):
        # Prior standard deviations of the log of a residual RMS: of its level, and of its model error.
        add("residual", j, np.log(residual[j]) * one, 1.0 * one, 0.3)
    return found
