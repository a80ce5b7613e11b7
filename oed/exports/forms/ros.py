"""ROS 2: trajectory_msgs/JointTrajectory and the goal of control_msgs/FollowJointTrajectory, as YAML or JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
import yaml

from oed.exports.forms.base import NANOSECONDS, Array, ExportOptions, Form
from robots.common.errors import InputError
from robots.robot import Robot
from robots.signals import Motion


class Ros(Form):
    """A JointTrajectory, as ``ros2 topic pub`` takes it; times since its start."""

    name: ClassVar[str] = "ros"
    suffixes: ClassVar[tuple[str, ...]] = (".yaml", ".json")
    comment: ClassVar[Mapping[str, str]] = {".yaml": "#"}

    def write(self, motion: Motion, robot: Robot, options: ExportOptions, suffix: str) -> bytes:
        """See `Form.write`."""
        return _text(_trajectory(motion, robot), suffix)

    def read(self, content: bytes, robot: Robot, suffix: str) -> tuple[Array, Array]:
        """See `Form.read`; joints may stand in any order."""
        return _points(_parsed(content, suffix), robot)


class RosGoal(Form):
    """The goal of a FollowJointTrajectory action, as ``ros2 action send_goal`` takes it."""

    name: ClassVar[str] = "ros-goal"
    suffixes: ClassVar[tuple[str, ...]] = (".yaml", ".json")
    comment: ClassVar[Mapping[str, str]] = {".yaml": "#"}

    def write(self, motion: Motion, robot: Robot, options: ExportOptions, suffix: str) -> bytes:
        """See `Form.write`."""
        tolerance = [{"name": name, "position": options.start_tolerance} for name in robot.joint_names]
        goal = {"trajectory": _trajectory(motion, robot), "goal_tolerance": tolerance}
        return _text(goal | {"goal_time_tolerance": {"sec": 1, "nanosec": 0}}, suffix)

    def read(self, content: bytes, robot: Robot, suffix: str) -> tuple[Array, Array]:
        """See `Form.read`."""
        goal = _parsed(content, suffix)
        if "trajectory" not in goal:
            raise InputError("no trajectory in the goal", allowed="a FollowJointTrajectory goal")
        return _points(goal["trajectory"], robot)


def _trajectory(motion: Motion, robot: Robot) -> dict[str, Any]:
    nanoseconds = np.round((motion.t - motion.t[0]) * NANOSECONDS).astype(np.int64).tolist()
    rows = zip(motion.q.tolist(), motion.dq.tolist(), motion.ddq.tolist(), nanoseconds, strict=True)
    return {
        "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""},
        "joint_names": list(robot.joint_names),
        "points": [
            {
                "positions": q,
                "velocities": dq,
                "accelerations": ddq,
                "effort": [],
                "time_from_start": {"sec": time // NANOSECONDS, "nanosec": time % NANOSECONDS},
            }
            for q, dq, ddq, time in rows
        ],
    }


def _text(content: dict[str, Any], suffix: str) -> bytes:
    if suffix == ".json":
        return (json.dumps(content, allow_nan=False) + "\n").encode()
    dumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
    return yaml.dump(content, Dumper=dumper, default_flow_style=None, sort_keys=False, width=10**9).encode()


def _parsed(content: bytes, suffix: str) -> dict[str, Any]:
    try:
        loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
        found = json.loads(content) if suffix == ".json" else yaml.load(content, Loader=loader)
    except (ValueError, yaml.YAMLError) as error:
        raise InputError(f"not {suffix[1:].upper()} ({error})") from error
    if not isinstance(found, dict):
        raise InputError("no mapping", allowed="a ROS message")
    return found


def _points(trajectory: dict[str, Any], robot: Robot) -> tuple[Array, Array]:
    names = list(robot.joint_names)
    try:
        found = list(trajectory["joint_names"])
        order = [found.index(name) for name in names]
        stamps = [point["time_from_start"] for point in trajectory["points"]]
        t = np.array([stamp["sec"] + stamp["nanosec"] / NANOSECONDS for stamp in stamps])
        q = np.array([point["positions"] for point in trajectory["points"]], dtype=float)
        return t, q[:, order]
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise InputError(
            f"no JointTrajectory of {robot.name} ({error})", allowed=f"joint_names {', '.join(names)}, and points"
        ) from error
