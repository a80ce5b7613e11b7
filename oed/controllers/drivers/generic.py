"""A controller that follows ROS-Industrial's library and client, as its simulator does."""

from __future__ import annotations

from oed.controllers.drivers.base import Driver

GENERIC = Driver(
    name="generic",
    title="the driver",
    source="industrial_core: simple_message, industrial_robot_client (REP-I0004)",
    one_form=False,
    feedback="full",
    feedback_period=0.01,
)
