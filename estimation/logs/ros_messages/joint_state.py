"""``sensor_msgs/JointState``, which most drivers publish as ``/joint_states``."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from estimation.logs.ros_messages.joint_message import JointMessage, JointValues, stamp_of


class JointState(JointMessage):
    """Positions, velocities and efforts, each with one value a joint or none at all."""

    kind: ClassVar[str] = "sensor_msgs/msg/JointState"
    field: ClassVar[str] = "effort"
    quantity: ClassVar[Literal["torque", "effort"]] = "effort"
    meaning: ClassVar[str] = (
        "what the robot's driver publishes; UR's driver publishes motor currents [A], and since 2026 also torques"
    )

    def values(self, message: Any) -> JointValues:
        """Reads a message."""
        return JointValues(
            names=message.name,
            position=message.position,
            velocity=message.velocity,
            effort=message.effort,
            stamp=stamp_of(message),
        )
