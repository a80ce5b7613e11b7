"""The quantities of a new monitor, with priors by the residual that the model states."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from estimation.monitoring.control_charts.charts import Chart
from estimation.monitoring.control_charts.level_filter import LevelFilter
from estimation.monitoring.control_charts.quantities import SHARE, Group, Quantity
from estimation.monitoring.settings import MonitorSettings
from estimation.monitoring.windows.baseline import Baseline
from estimation.monitoring.windows.heat import HeatState
from estimation.monitoring.windows.projection import Window

Array = NDArray[np.float64]

# A model without a stated residual: share of the torque.
USUAL_RESIDUAL = 0.05
# Prior standard deviations of the log of a residual RMS: of its model error, and of its level.
RESIDUAL_SCATTER, RESIDUAL_SPREAD = 0.3, 1.0


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
    residual = np.where(np.isfinite(baseline.residual), baseline.residual, USUAL_RESIDUAL * window.torque_rms)
    residual = np.maximum(residual, 1e-6 * max(float(window.torque_rms.max()), 1e-9))

    def add(group: Group, index: int, mean: Array, spread: Array, scatter: float) -> None:
        # Besides friction: what is smaller than half of the model's own residual is no finding.
        margin = float(np.log1p(settings.smallest)) if group == "friction" else scatter
        chart = Chart(window=settings.window, run_length=run_length)
        found.append(Quantity(group, index, LevelFilter(mean, spread, scatter), chart, margin))

    mean, spread = heat.prior
    for j in range(n):
        add("friction", j, mean, spread, min(SHARE * residual[j] / max(window.friction_rms[j], 1e-9), 0.3))
    zero, one = np.zeros(1), np.ones(1)
    for j in range(n):
        add("offset", j, zero, residual[j] * one, SHARE * residual[j])
    level = float(np.sqrt(np.mean(residual**2)))
    for k in range(baseline.payload_count):
        size = level / max(float(np.sqrt(np.mean(payload[:, :, k] ** 2))), 1e-9)
        add("payload", k, zero, size * one, SHARE * size)
    common = max(float(heat.common_spread[0]), 1e-9)
    add("common", 0, zero, common * one, SHARE * common)
    for j in range(n):
        add("residual", j, np.log(residual[j]) * one, RESIDUAL_SPREAD * one, RESIDUAL_SCATTER)
    return found
