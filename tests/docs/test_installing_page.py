"""The page on installing lists what the project depends on."""

from __future__ import annotations

import re
import tomllib

import pytest

from benchmarks.sentence_lengths import ROOT

PAGE = (ROOT / "docs" / "installing.md").read_text(encoding="utf-8")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def rows(title: str) -> set[str]:
    """The names in the first column of a section's table."""
    section = re.search(rf"^## {title}\n(.*?)(?=^## |\Z)", PAGE, re.MULTILINE | re.DOTALL)
    cells = re.findall(r"^\| (`[^|]*) \|", section.group(1), re.MULTILINE)
    return {name for cell in cells for name in re.findall(r"`([\w-]+)`", cell)}


@pytest.mark.parametrize(
    ("title", "wanted"),
    [
        ("Dependencies", {re.split(r"[<>=;\s]", line)[0] for line in PROJECT["dependencies"]}),
        ("Extras", set(PROJECT["optional-dependencies"])),
    ],
)
def test_tables_are_complete(title, wanted):
    """Each dependency and each extra has its row, and nothing else has."""
    assert rows(title) == wanted
