"""``lbr_fri_idl/LBRState``: what KUKA's fast robot interface gives to the stack for LBR robots."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from estimation.logs.ros_messages.joint_message import JointMessage, JointValues


class LbrState(JointMessage):
    """Measured positions and torques, without names of joints and with the controller's time."""

    kind: ClassVar[str] = "lbr_fri_idl/msg/LBRState"
    field: ClassVar[str] = "measured_torque"
    quantity: ClassVar[Literal["torque", "effort"]] = "torque"
    meaning: ClassVar[str] = (
        "the joint torque sensors, gravity included; some versions state the load's torque, which has the other sign"
    )

    def values(self, message: Any) -> JointValues:
        """Reads a message."""
        return JointValues(
            names=(),
            position=message.measured_joint_position,
            velocity=(),
            effort=message.measured_torque,
            stamp=float(message.time_stamp_sec) + 1e-9 * float(message.time_stamp_nano_sec),
        )
