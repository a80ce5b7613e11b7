"""The robot's description that a user has: a URDF and a YAML file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin

from oed.benchmarks.truth.machines import Machine


def write_description(machine: Machine, folder: Path, *, drives: bool = True) -> Path:
    """Writes ``NAME.urdf`` and ``NAME.yaml`` of the described robot, which differs from the true one.

    Args:
        machine: the robot.
        folder: an existing folder.
        drives: whether to state gear ratios and rotor inertias, which a URDF cannot state.

    Returns:
        The path of the YAML file.
    """
    (folder / f"{machine.name}.urdf").write_text(urdf_of(machine.known, machine.name))
    lines = [f"name: {machine.name}_described", f"urdf: {machine.name}.urdf", "limits:"]
    lines += [f"  acceleration: {{values: {_list(machine.acceleration)}, unit: rad/s2, source: datasheet}}"]
    if drives:
        motor = machine.known_rotor / machine.gear**2
        lines += ["dynamics:", "  drives:", f"    gear_ratio: {{values: {_list(machine.gear)}, source: datasheet}}"]
        lines += [f"    rotor_inertia: {{values: {_list(motor)}, source: datasheet}}"]
    path = folder / f"{machine.name}.yaml"
    path.write_text("\n".join([*lines, ""]))
    return path


def urdf_of(model: pin.Model, name: str) -> str:
    """Writes a chain of revolute joints as URDF text, with the axes of pinocchio's joints."""
    rows = [f'<robot name="{name}">', '  <link name="base"/>']
    data = model.createData()
    for joint in range(1, model.njoints):
        q = np.zeros(model.nq)
        pin.computeJointJacobians(model, data, q)
        axis = pin.getJointJacobian(model, data, joint, pin.LOCAL)[3:, joint - 1]
        rows += _link(joint, model.inertias[joint])
        parent = "base" if joint == 1 else f"link{joint - 1}"
        place = model.jointPlacements[joint]
        roll, pitch, yaw = pin.rpy.matrixToRpy(place.rotation)
        k = joint - 1
        limit = f'lower="{model.lowerPositionLimit[k]:.9g}" upper="{model.upperPositionLimit[k]:.9g}"'
        rows += [
            f'  <joint name="J{joint}" type="revolute">',
            f'    <parent link="{parent}"/><child link="link{joint}"/>',
            f'    <origin xyz="{_text(place.translation)}" rpy="{_text((roll, pitch, yaw))}"/>',
            f'    <axis xyz="{_text(np.round(axis, 12))}"/>',
            f'    <limit {limit} velocity="{model.velocityLimit[k]:.9g}" effort="{model.effortLimit[k]:.9g}"/>',
            "  </joint>",
        ]
    return "\n".join([*rows, "</robot>", ""])


def _link(joint: int, body: pin.Inertia) -> list[str]:
    i = body.inertia
    moments = f'ixx="{i[0, 0]:.12g}" ixy="{i[0, 1]:.12g}" ixz="{i[0, 2]:.12g}" '
    moments += f'iyy="{i[1, 1]:.12g}" iyz="{i[1, 2]:.12g}" izz="{i[2, 2]:.12g}"'
    return [
        f'  <link name="link{joint}"><inertial>',
        f'    <origin xyz="{_text(body.lever)}" rpy="0 0 0"/><mass value="{body.mass:.12g}"/><inertia {moments}/>',
        "  </inertial></link>",
    ]


def _text(values: object) -> str:
    return " ".join(f"{value:.17g}" for value in np.asarray(values, dtype=float))


def _list(values: np.ndarray) -> str:
    return "[" + ", ".join(f"{value:.9g}" for value in values) + "]"
