"""Links to a controller: the same frames by UDP and by TCP."""

from oed.controllers.links.base import Link
from oed.controllers.links.opening import open_link

__all__ = ["Link", "open_link"]
