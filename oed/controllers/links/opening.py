"""Opens a link by the transport that an endpoint names."""

from __future__ import annotations

from oed.controllers.egm.link import EgmLink
from oed.controllers.links.base import Link
from oed.controllers.links.tcp import TcpLink
from oed.controllers.links.udp import UdpLink
from oed.controllers.options import Endpoint
from oed.controllers.rtde.link import RtdeLink, ScriptLink


def open_link(endpoint: Endpoint, port: int) -> Link:
    """Connects to a port of a controller.

    Args:
        endpoint: the controller.
        port: its motion port or its state port.

    Raises:
        InputError: a host that has no address.
        LinkError: nothing answers within the time, or the connection is refused.
    """
    if endpoint.protocol == "egm":
        return EgmLink(endpoint, port)
    if endpoint.protocol == "rtde":
        return (RtdeLink if port == endpoint.state_port else ScriptLink)(endpoint, port)
    return (UdpLink if endpoint.transport == "udp" else TcpLink)(endpoint, port)
