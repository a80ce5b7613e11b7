"""Values that a shell completes."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest


@pytest.mark.parametrize(
    ("typed", "wanted"),
    [
        ("oed design --robot ur1", ["ur10"]),
        ("oed design --effort st", ["standard"]),
        ("oed identify --method hu", ["huber"]),
        ("oed effects payload", ["payload_change"]),
        ("oed simulate --robot nothing", []),
    ],
)
def test_values_are_completed(typed: str, wanted: list[str]) -> None:
    """What begins with the typed letters is offered; for other texts nothing, and the shell completes files."""
    words = {"_OED_COMPLETE": "complete_bash", "COMP_WORDS": typed, "COMP_CWORD": str(len(typed.split()) - 1)}
    done = subprocess.run(
        [sys.executable, "-m", "oed"], env=os.environ | words, capture_output=True, text=True, check=False
    )
    assert done.stdout.split() == wanted
