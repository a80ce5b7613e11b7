"""ROS-Industrial's driver for ABB controllers (IRC5)."""

from __future__ import annotations

from oed.controllers.drivers.base import Driver

ABB = Driver(
    name="abb",
    title="ABB's driver",
    source="abb_driver: rapid/ROS_motionServer.mod, rapid/ROS_messages.sys, rapid/ROS_common.sys",
    download=True,
    capacity=100,
    # MAX_TRAJ_LENGTH; further points are left out with a warning on the display.
    most=100,
    replies="bare",
    # Another type than JOINT_TRAJ_PT raises an error that nothing handles.
    pings="end",
    # MoveAbsJ rounds corners, and lengthens a move that is too fast.
    timed=False,
    feedback_period=0.1,
)
