"""``franka_msgs/FrankaState`` of Franka's ROS 1 driver and of the first versions for ROS 2."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from estimation.logs.ros_messages.joint_message import JointMessage, JointValues, stamp_of


class FrankaState(JointMessage):
    """The whole state of a Franka robot, without names of joints."""

    kind: ClassVar[str] = "franka_msgs/msg/FrankaState"
    field: ClassVar[str] = "tau_J"
    quantity: ClassVar[Literal["torque", "effort"]] = "torque"
    meaning: ClassVar[str] = "the link-side joint torque sensors, gravity included"

    def values(self, message: Any) -> JointValues:
        """Reads a message; its fields of ROS 1 have capitals."""
        return JointValues(
            names=(),
            position=message.q,
            velocity=message.dq,
            effort=message.tau_J if hasattr(message, "tau_J") else message.tau_j,
            stamp=stamp_of(message),
        )
