"""The page of all results in a folder."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from typing import Any
from urllib.parse import quote

from oed.overviews.entries import Entry
from oed.reports.rendering.html import format_cell, render
from oed.reports.rendering.page import Page
from oed.reports.rendering.provenance import footer

SHOWN = 3
"""Key figures of a result in its row; all are shown side by side."""


def overview_html(entries: Sequence[Entry], *, folder: str, links: str = "") -> str:
    """Writes the page as one file.

    Args:
        entries: the results.
        folder: its name, for the title.
        links: what comes before the path of a file in its address, such as "files/".
    """
    kinds = Counter(entry.kind for entry in entries)
    act = sum(entry.level == "act" for entry in entries)
    counted = ", ".join(f"{kind} {count}" for kind, count in sorted(kinds.items()))
    verdict = f"{len(entries)} results, {act} of them ask for action." if entries else "This folder has no results."
    page = Page(title=f"Results in {folder}", verdict=verdict, footer=footer())
    return render(
        page,
        template="overview.html.j2",
        context={
            "rows": [_row(entry, links) for entry in entries],
            "robots": sorted({entry.robot for entry in entries} - {""}),
            "kinds": sorted(kinds),
            "counted": counted,
        },
    )


def _row(entry: Entry, links: str) -> dict[str, Any]:
    figures = {label: value for label, value in entry.figures.items() if value is not None}
    written = {label: format_cell(value) for label, value in figures.items()}
    return {
        "entry": entry,
        "figures": "; ".join(f"{label} {value}" for label, value in list(written.items())[:SHOWN]),
        "all": json.dumps(written),
        "data": _address(links, entry.path),
        "report": _address(links, entry.report) if entry.report else "",
        "rank": {"act": 3, "note": 2, "good": 1}.get(entry.level or "", 0),
    }


def _address(links: str, path: str) -> str:
    # "./" keeps a name with a colon from being taken for a scheme.
    return f"./{links}{quote(path)}"
