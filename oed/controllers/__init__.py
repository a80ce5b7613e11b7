"""Ways to a controller: play a trajectory, record the feedback, and a controller to test against."""

from __future__ import annotations

from robots.common.lazy import lazy_exports

# The stub beside this file says which module has which name.
__getattr__, __dir__, __all__ = lazy_exports(__name__, __file__)
