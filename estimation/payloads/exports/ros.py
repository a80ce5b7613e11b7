"""ROS 2: a parameter file."""

from __future__ import annotations

from typing import ClassVar

from estimation.payloads.body import Body
from estimation.payloads.exports.base import PayloadExport, number


class RosParameters(PayloadExport):
    """Parameters ``payload.mass``, ``payload.center_of_gravity.x`` .., ``payload.ixx`` .. for any node.

    The file has the form of ROS 2 parameter files
    (https://docs.ros.org/en/humble/How-To-Guides/Migrating-from-ROS1/Migrating-Parameters.html). The names are those of
    the service ``ur_msgs/srv/SetPayload`` (https://docs.ros.org/en/jazzy/p/ur_msgs/srv/SetPayload.html): mass [kg],
    centre of gravity [m] in the flange frame, inertia about it [kg m2] in the flange's axes.
    """

    name: ClassVar[str] = "ros"
    file: ClassVar[str] = "payload_parameters.yaml"
    title: ClassVar[str] = "parameter file of ROS 2"

    def text(self, body: Body, title: str) -> str:
        """Writes the parameters."""
        I = body.inertia  # noqa: E741
        lines = [f"# {title}", "# kg, m, kg m2; inertia about the centre of gravity, in the flange's axes"]
        lines += ["/**:", "  ros__parameters:", "    payload:", f"      mass: {number(body.mass)}"]
        lines.append("      center_of_gravity:")
        lines += [f"        {axis}: {number(value)}" for axis, value in zip("xyz", body.centre, strict=True)]
        for name in ("xx", "yy", "zz", "xy", "xz", "yz"):
            lines.append(f"      i{name}: {number(I['xyz'.index(name[0]), 'xyz'.index(name[1])])}")
        return "\n".join([*lines, ""])
