"""Texts of a page, and those of its findings that stand on it more than once."""

from __future__ import annotations

from collections.abc import Iterator

from oed.reports import Page

SHORT = 25
"""Texts of fewer characters may be names that stand in several places."""


def texts(page: Page) -> Iterator[str]:
    """All texts that a reader sees, but for pictures and the footer."""
    yield page.verdict
    for row in page.listed:
        yield f"{row.subject} {row.text} {row.action}"
    for section in page.sections:
        yield from (section.title, *section.paragraphs)
        for table in section.tables:
            yield from (table.caption, *(str(cell) for cells in table.rows for cell in cells))


def said_twice(page: Page) -> list[str]:
    """Sentences of findings that do not stand on the page exactly once."""
    seen = list(texts(page))
    sentences = {finding.text.rstrip(".") for finding in page.findings if len(finding.text) > SHORT}
    return [sentence for sentence in sentences if sum(text.count(sentence) for text in seen) != 1]
