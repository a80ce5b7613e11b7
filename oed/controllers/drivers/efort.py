"""The program of the thesis for a Robox RP-1 controller (Efort robots)."""

from __future__ import annotations

from oed.controllers.drivers.base import Driver

EFORT = Driver(
    name="efort",
    title="the thesis' program",
    source="thesis, appendix A: task_motion and feedback_task",
    transport="udp",
    points="full",
    capacity=100,
    replies="bare",
    # A datagram of any length makes it store the point again that it holds, and reply with that message's type.
    pings="point",
    stands=False,
    one_handshake=True,
    feedback="position",
    feedback_period=0.004,
)
