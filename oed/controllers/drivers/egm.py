"""ABB's Externally Guided Motion: positions in each cycle, in time."""

from __future__ import annotations

from oed.controllers.drivers.base import Driver

EGM = Driver(
    name="egm",
    title="EGM",
    source="egm.proto of RobotWare (ros-industrial/abb_libegm)",
    protocol="egm",
    transport="udp",
    # Of this computer: the controller is the client. There is one port.
    motion_port=6510,
    state_port=6510,
    points="full",
    pings="unknown",
    feedback="position",
    feedback_period=0.004,
)
