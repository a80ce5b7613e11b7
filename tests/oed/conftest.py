"""One browser for all tests of reports."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from oed.reports import Page
from tests.oed.reports.browser import Browser, program
from tests.oed.reports.browser_checks import check_page


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """A real browser without a window and without a network."""
    if program() is None and not os.environ.get("OED_TEST_BROWSER"):
        pytest.skip("no Chromium is installed")
    with Browser() as started:
        yield started


@pytest.fixture
def in_browser(browser: Browser, tmp_path: Path) -> Callable[[Page], None]:
    """Checks a page in the browser: see `tests.oed.reports.browser_checks`."""
    return lambda page: check_page(browser, page, tmp_path / "report.html")
