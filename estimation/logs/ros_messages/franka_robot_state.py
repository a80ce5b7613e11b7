"""``franka_msgs/FrankaRobotState`` of Franka's ROS 2 driver."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from estimation.logs.ros_messages.joint_message import HEADER, JointMessage, JointValues, stamp_of


class FrankaRobotState(JointMessage):
    """The whole state of a Franka robot; its measured joint state has q, dq and tau_J."""

    kind: ClassVar[str] = "franka_msgs/msg/FrankaRobotState"
    field: ClassVar[str] = "measured_joint_state.effort"
    quantity: ClassVar[Literal["torque", "effort"]] = "torque"
    meaning: ClassVar[str] = "tau_J, the link-side joint torque sensors, gravity included"
    definition: ClassVar[str] = (
        HEADER + "franka_msgs/CollisionIndicators collision_indicators\n"
        "sensor_msgs/JointState measured_joint_state\n"
        f"{'=' * 80}\nMSG: franka_msgs/CollisionIndicators\n"
        "geometry_msgs/Vector3 a\ngeometry_msgs/Vector3 b\ngeometry_msgs/Vector3 c\ngeometry_msgs/Vector3 d\n"
        "float64[7] e\nfloat64[7] f\n"
    )

    def values(self, message: Any) -> JointValues:
        """Reads a message."""
        state = message.measured_joint_state
        return JointValues(
            names=state.name,
            position=state.position,
            velocity=state.velocity,
            effort=state.effort,
            stamp=stamp_of(message),
        )
