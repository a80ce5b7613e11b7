"""Types of ROS messages with the state of joints: one a file."""

from estimation.logs.ros_messages.controller_state import ControllerState
from estimation.logs.ros_messages.franka_robot_state import FrankaRobotState
from estimation.logs.ros_messages.franka_state import FrankaState
from estimation.logs.ros_messages.joint_message import JointMessage, JointValues
from estimation.logs.ros_messages.joint_state import JointState
from estimation.logs.ros_messages.lbr_state import LbrState

__all__ = ["MESSAGES", "JointMessage", "JointValues"]

MESSAGES: tuple[JointMessage, ...] = (JointState(), FrankaRobotState(), FrankaState(), LbrState(), ControllerState())
"""All known types, in the order in which they are preferred."""
