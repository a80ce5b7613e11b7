"""Monitoring: changes of a robot beside its identified model, with what temperature explains taken out."""

from estimation.monitoring.baseline import Baseline, baseline_of, read_baseline
from estimation.monitoring.findings import Finding
from estimation.monitoring.monitor import Monitor
from estimation.monitoring.settings import MonitorSettings

__all__ = ["Baseline", "Finding", "Monitor", "MonitorSettings", "baseline_of", "read_baseline"]
