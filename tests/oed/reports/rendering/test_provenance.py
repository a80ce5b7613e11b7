"""Where a report comes from."""

from __future__ import annotations

import hashlib
import sys
from pathlib import Path

import pytest

from oed.reports.rendering.provenance import Recording, footer


def test_inputs_are_what_the_command_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Files and folders of the command line are listed with their digests, results are not, the seed is stated."""
    log, folder = tmp_path / "log.csv", tmp_path / "design"
    log.write_bytes(b"t,q\n")
    folder.mkdir()
    (folder / "a").write_bytes(b"1")
    (tmp_path / "out").mkdir()
    words = ["--log", str(log), "--design", str(folder), "--payload", f"1={log}", "--out", str(tmp_path / "out")]
    monkeypatch.setattr(sys, "argv", ["/somewhere/__main__.py", "identify", *words, "--seed=7"])
    found = footer()
    digest = hashlib.sha256(b"t,q\n").hexdigest()
    inner = hashlib.sha256(hashlib.sha256(b"1").hexdigest().encode()).hexdigest()
    assert [(item.name, item.sha256, item.size) for item in found.inputs] == [
        (str(log), digest, 4),
        (str(folder), inner, 1),
    ]
    assert found.seed == 7
    assert found.command.startswith("oed identify --log")
    assert {"Python", "numpy", "scipy"} <= {name for name, _ in found.versions}
    assert footer(seed=3).seed == 3


def test_clocks_without_a_date_give_none() -> None:
    """A clock that counts from 1970 has a date; one that counts from the start of the log has none."""
    assert Recording(name="a", start=1_738_310_400.0).date == "2025-01-31 08:00 UTC"
    assert [Recording(name="a", start=start).date for start in (0.0, None, float("nan"))] == ["", "", ""]
