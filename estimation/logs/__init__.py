"""Logs of robots: from files and to files."""

from estimation.logs.mappings.mapping import LogMapping, read_mapping
from estimation.logs.reading import read_log, read_logs
from estimation.logs.writing import write_log

__all__ = ["LogMapping", "read_log", "read_logs", "read_mapping", "write_log"]
