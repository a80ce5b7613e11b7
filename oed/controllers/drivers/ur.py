"""Controllers of Universal Robots: no program is needed on them."""

from __future__ import annotations

from oed.controllers.drivers.base import Driver

UR = Driver(
    name="ur",
    title="UR's controller",
    source="the RTDE guide and the script manual of Universal Robots; Universal_Robots_Client_Library: "
    "resources/external_control.urscript",
    protocol="rtde",
    # Programs.
    motion_port=30002,
    # RTDE.
    state_port=30004,
    byte_order="big",
    points="full",
    pings="unknown",
    feedback="full",
    feedback_period=0.002,
)
