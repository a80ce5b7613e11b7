"""The page of codes is made from the table; run this file to write it again."""

from __future__ import annotations

from pathlib import Path

from estimation.gate.explanations import EXPLANATIONS
from robots.common.errors import ERRORS

PAGE = Path(__file__).parents[2] / "docs" / "codes.md"

HEAD = """# Codes of messages

`oed check` and all commands that read logs state a code with each finding (`OED-L`). Frequent errors end with one:
`OED-D` of data files, `OED-R` of robot descriptions, `OED-O` of options, `OED-F` of files of results. `oed explain
CODE` prints its entry. A code never changes its meaning.
"""


def page() -> str:
    """The page as the table gives it."""
    parts = [
        f"## {item.code}: {item.name.replace('_', ' ')}\n\n{item.meaning}\n\n- {item.cause}: {item.example}\n"
        f"- What to do: {item.remedy}\n"
        for item in (*EXPLANATIONS, *ERRORS)
    ]
    return "\n".join([HEAD, *parts])


def test_the_page_is_that_of_the_table():
    """Every code has its entry, and none is left of an older table."""
    assert PAGE.read_text(encoding="utf-8") == page()


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
