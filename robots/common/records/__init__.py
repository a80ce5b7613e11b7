"""Results as plain data: written, read back, and checked."""

from robots.common.records.entries import entries_of, plain
from robots.common.records.files import damage_refused, read_json, write_json
from robots.common.records.findings import Finding, effect_code, findings_of, severity
from robots.common.records.reading import read, read_null_as
from robots.common.records.record import Record, Result, axes_for

__all__ = [
    "Finding",
    "Record",
    "Result",
    "axes_for",
    "damage_refused",
    "effect_code",
    "entries_of",
    "findings_of",
    "plain",
    "read",
    "read_json",
    "read_null_as",
    "severity",
    "write_json",
]
