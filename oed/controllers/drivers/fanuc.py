"""ROS-Industrial's driver for Fanuc controllers."""

from __future__ import annotations

from oed.controllers.drivers.base import Driver

FANUC = Driver(
    name="fanuc",
    title="Fanuc's driver",
    source="fanuc_driver: karel/ros_relay.kl, karel/libind_pkt.kl, karel/ros_state.kl",
    # KAREL writes numbers as the processor of the controller holds them; `use_bswap` of its launch files.
    byte_order="big",
    # One point in the position register, and one that waits at the socket.
    capacity=2,
    # Number of the point and zeros; it comes before the point is played.
    replies="position",
    pings="point",
    # ros_movesm moves with 20 % of the speed and CNT 50.
    timed=False,
    fixed_packets=True,
    feedback_period=0.025,
)
