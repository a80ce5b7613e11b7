"""A page and its pictures as files."""

from __future__ import annotations

from datetime import UTC, datetime

from oed.reports.rendering.command_lines import command_line
from oed.reports.rendering.matplotlib_ import save_png
from oed.reports.rendering.page import Footer, Page, render
from robots.common.files import ResultFolder, write_atomic
from robots.version import VERSION

REPORT = "report.html"


def save_page(page: Page, folder: ResultFolder, *, png: bool = False) -> None:
    """Writes ``report.html`` and, on request, each picture as PNG."""
    write_atomic(folder.path(REPORT), render(page))
    if png:
        for picture in page.pictures:
            save_png(picture, folder.path(f"{picture.name}.png"))


def footer() -> Footer:
    """Says which tool made the page, when, and by which command."""
    return Footer(tool=f"robot-oed {VERSION}", date=f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC", command=command_line())
