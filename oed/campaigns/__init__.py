"""Campaigns: stages that are repeated on one clock, and the virtual robot that plays them."""

from __future__ import annotations

from robots.common.lazy import lazy_exports

# The stub beside this file says which module has which name.
__getattr__, __dir__, __all__ = lazy_exports(__name__, __file__)
