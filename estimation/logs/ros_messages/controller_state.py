"""``control_msgs/JointTrajectoryControllerState``: reference and measurement of a trajectory controller."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from estimation.logs.ros_messages.joint_message import HEADER, JointMessage, JointValues, stamp_of


class ControllerState(JointMessage):
    """The measured point: ``feedback``, or ``actual`` in older versions. Few controllers fill in its effort."""

    kind: ClassVar[str] = "control_msgs/msg/JointTrajectoryControllerState"
    field: ClassVar[str] = "effort of the measured point"
    quantity: ClassVar[Literal["torque", "effort"]] = "effort"
    meaning: ClassVar[str] = "what the robot's driver gives to the controller"
    # In all versions the second point is the measured one.
    definition: ClassVar[str] = (
        HEADER + "string[] joint_names\n"
        "trajectory_msgs/JointTrajectoryPoint reference\ntrajectory_msgs/JointTrajectoryPoint feedback\n"
    )

    def values(self, message: Any) -> JointValues:
        """Reads a message."""
        point = getattr(message, "feedback", None) or message.actual
        # Versions that have both fill in one of them.
        if not len(point.positions) and hasattr(message, "actual"):
            point = message.actual
        return JointValues(
            names=message.joint_names,
            position=point.positions,
            velocity=point.velocities,
            effort=point.effort,
            stamp=stamp_of(message),
            command=(getattr(message, "reference", None) or message.desired).positions,
        )
