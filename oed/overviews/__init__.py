"""All results of a folder on one page: what was found, how urgent it is, and key figures side by side."""

from oed.overviews.entries import Entry, find_results
from oed.overviews.overview_page import overview_html
from oed.overviews.server import OverviewServer

__all__ = ["Entry", "OverviewServer", "find_results", "overview_html"]
