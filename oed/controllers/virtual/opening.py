"""The two ports of a controller, as its driver opens them."""

from __future__ import annotations

from oed.controllers.virtual.fixed_packets import FixedPackets
from oed.controllers.virtual.ports import Port, TcpPort, UdpPort
from oed.controllers.virtual_options import ControllerOptions
from oed.exports.simple_message import Bare, Comm, Frame, Kind, Reply, Splitter

RECORDERS = 16
"""Clients of the state port."""


def open_ports(options: ControllerOptions) -> tuple[Port, Port]:
    """Opens the motion port and the state port.

    Raises:
        InputError: a taken port, or an address of another computer.
    """
    o, driver = options, options.driver
    once = driver is not None and driver.one_handshake
    cut = FixedPackets if driver is not None and driver.fixed_packets else Splitter
    if o.transport == "tcp":
        motion: Port = TcpPort(o.host, o.motion_port, lambda: cut(o.form), 1)
    else:
        # The thesis' program stores the point again that it holds, and replies.
        stale = o.form.encode(Frame(Bare(kind=Kind.JOINT_TRAJ_PT_FULL), Comm.REPLY, Reply.SUCCESS)) if once else None
        motion = UdpPort(o.host, o.motion_port, o.handshake, 1, once, stale)
    try:
        if o.transport == "tcp":
            return motion, TcpPort(o.host, o.state_port, lambda: Splitter(o.form), RECORDERS)
        return motion, UdpPort(o.host, o.state_port, o.handshake, 1 if once else RECORDERS, once, None)
    except BaseException:
        motion.close()
        raise
