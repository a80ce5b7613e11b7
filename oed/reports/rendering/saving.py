"""A page and its pictures as files."""

from __future__ import annotations

from oed.reports.rendering.html import render
from oed.reports.rendering.matplotlib_ import save_png
from oed.reports.rendering.page import Page
from robots.common.files import ResultFolder, write_atomic

REPORT = "report.html"


def save_page(page: Page, folder: ResultFolder, *, png: bool = False) -> None:
    """Writes ``report.html`` and, on request, each picture as PNG."""
    write_atomic(folder.path(REPORT), render(page))
    if png:
        for picture in page.pictures:
            save_png(picture, folder.path(f"{picture.name}.png"))
