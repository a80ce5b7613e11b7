"""Recordings: the logs of one robot, made ready once for all that is asked of them."""

from __future__ import annotations

from robots.common.lazy import lazy_exports

# The stub beside this file says which module has which name. The gate, which a recording of several logs asks, asks the
# rows of one log itself.
__getattr__, __dir__, __all__ = lazy_exports(__name__, __file__)
