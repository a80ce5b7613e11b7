"""Folders of logs."""

from pathlib import Path

from estimation.logs.campaigns import in_natural_order, log_files


def test_numbers_in_names_count_by_value(tmp_path):
    """`run7` comes before `run10`, whatever stands around the number."""
    for name in ("run10.csv", "run7.csv", "run8b.csv", "run8.csv", "a.csv"):
        (tmp_path / name).write_text("")
    assert [file.name for file in log_files(tmp_path)] == ["a.csv", "run7.csv", "run8.csv", "run8b.csv", "run10.csv"]
    dates = [Path(f"2026-{month:02d}-{day:02d}.csv") for month in (1, 11) for day in (2, 10)]
    assert in_natural_order(reversed(dates)) == dates
