"""Monitoring: changes of a robot beside its identified model, with what temperature explains taken out."""

from estimation.monitoring.findings import Finding
from estimation.monitoring.log_row import LogRow
from estimation.monitoring.monitor import Monitor
from estimation.monitoring.result import MonitorResult
from estimation.monitoring.settings import MonitorSettings
from estimation.monitoring.stored_logs.log_monitoring import monitor_logs
from estimation.monitoring.windows.baseline import Baseline, baseline_of, read_baseline

__all__ = [
    "Baseline",
    "Finding",
    "LogRow",
    "Monitor",
    "MonitorResult",
    "MonitorSettings",
    "baseline_of",
    "monitor_logs",
    "read_baseline",
]
