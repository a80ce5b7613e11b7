"""Monitoring: changes of a robot beside its identified model, with what temperature explains taken out."""

from estimation.monitoring.findings import Finding as Finding
from estimation.monitoring.log_row import LogRow as LogRow
from estimation.monitoring.monitor import Monitor as Monitor
from estimation.monitoring.monitor import open_monitor as open_monitor
from estimation.monitoring.result import MonitorResult as MonitorResult
from estimation.monitoring.settings import MonitorSettings as MonitorSettings
from estimation.monitoring.stored_logs.log_files import read_monitored as read_monitored
from estimation.monitoring.stored_logs.log_monitoring import monitor_logs as monitor_logs
from estimation.monitoring.windows.baseline import Baseline as Baseline
from estimation.monitoring.windows.baseline import baseline_of as baseline_of
from estimation.monitoring.windows.baseline import read_baseline as read_baseline
