"""Verdicts, an estimate and its prediction are those of the last version that was meant to change them."""

import json
from pathlib import Path

import pytest

SMALL = Path(__file__).parents[1] / "benchmarks" / "frozen_small.jsonl"
STORED = {row["key"]: row for row in map(json.loads, SMALL.read_text(encoding="utf-8").splitlines())}
# Processors round differently, and an estimate's errors amplify that: they agree to four digits at least.
TOLERANCE = 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("key", STORED)
def test_a_frozen_row_is_computed_again(key):
    """A part of the frozen sets gives the numbers that were stored; `frozen.py run --part small` stores others."""
    pytest.importorskip("rosbags", reason="rosbags is not installed")
    pytest.importorskip("h5py", reason="h5py is not installed")
    from benchmarks import frozen
    from benchmarks.frozen_parts.comparing import differences, structure

    (item,) = (item for item in frozen.small() if item.key == key)
    assert list(differences(structure(STORED[key]), structure(frozen.row_of(item)), TOLERANCE)) == []


@pytest.mark.slow
def test_a_change_is_shown_and_rounding_and_wording_are_not(tmp_path, capsys):
    """A comparison names the rows that changed; other times, wordings and last digits are no change."""
    from benchmarks.frozen_parts.comparing import compare

    old, same, new = (tmp_path / name for name in ("old", "same", "new"))
    row = {"key": "gate/a", "seconds": 1.0, "text": "x", "value": [1.0, None], "verdict": "none"}
    old.write_text(json.dumps(row) + "\n")
    same.write_text(json.dumps({**row, "seconds": 2.0, "text": "y", "value": [1.0 + 1e-9, None]}) + "\n")
    new.write_text(json.dumps({**row, "value": [1.001, None]}) + "\n")
    assert compare(old, same) == 0
    assert "1 of 1 rows are the same" in capsys.readouterr().out
    assert compare(old, same, texts=True) == 1
    assert compare(old, new) == 1
    assert "gate/a" in (said := capsys.readouterr().out)
    assert "1.001" in said
    assert compare(old, new, relative=0.01) == 0
