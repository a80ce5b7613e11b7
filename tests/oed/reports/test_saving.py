"""Every result has one page, found by its class."""

from __future__ import annotations

from importlib import import_module

import pytest

from oed.reports import page_for
from oed.reports.rendering.saving import PAGES
from tests.oed.reports.pages.test_pages_in_browser import monitored, payload, prediction


@pytest.mark.parametrize("kind", PAGES)
def test_the_function_of_a_page_is_there(kind: str) -> None:
    """Each entry names a function that takes a result first."""
    module, _, name = PAGES[kind].rpartition(".")
    assert callable(getattr(import_module(f"oed.reports.pages.{module}"), name))


def test_a_page_is_found_by_the_class_of_its_result() -> None:
    """With what is shown beside the result."""
    assert page_for(monitored()).title == "Monitoring"
    assert page_for(payload()).verdict == payload().conclusion
    assert page_for(prediction(), robot_name="two", kinds=("revolute",) * 2).pictures
