"""MotoROS, the driver for Yaskawa Motoman controllers."""

from __future__ import annotations

from oed.controllers.drivers.base import Driver

MOTOMAN = Driver(
    name="motoman",
    title="Motoman's driver",
    source="motoman_driver: MotoPlus/MotionServer.c, MotoPlus/SimpleMessage.c, MotoPlus/Controller.h",
    motion_port=50240,
    state_port=50241,
    points="full",
    # A point that comes while one is processed is answered with BUSY.
    capacity=200,
    replies="motoman",
    commands=True,
    # valid_fields is 2.
    feedback="feedback",
    feedback_period=0.025,
)
