"""Logs of robots: from files and to files."""

from estimation.logs.reading import read_log, read_logs
from estimation.logs.writing import write_log

__all__ = ["read_log", "read_logs", "write_log"]
