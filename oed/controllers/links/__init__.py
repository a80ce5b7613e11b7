"""Links to a controller: the same frames by UDP and by TCP."""

from oed.controllers.links.base import Endpoint, Link
from oed.controllers.links.opening import open_link

__all__ = ["Endpoint", "Link", "open_link"]
