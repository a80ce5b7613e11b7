"""Franka: the configuration file of an end effector."""

from __future__ import annotations

import json
from typing import ClassVar

import numpy as np

from estimation.payloads.body import Body
from estimation.payloads.exports.base import PayloadExport


class Franka(PayloadExport):
    """``endeffector-config.json`` of an end effector archive.

    Mass [kg]; centre of mass (3) in the flange frame [m]; inertia (9) [kg m2], a column-major 3 x 3 matrix; the end
    effector's frame in the flange frame (16), a column-major 4 x 4 matrix, here the identity
    (https://download.franka.de/ride-cli-doc-v1.1.1/end_effector_commissioning.html). The inertia is about the centre of
    mass (libfranka, ``RobotState::I_ee``,
    https://docs.ros.org/en/humble/p/libfranka/generated/structfranka_1_1RobotState.html). ``Robot::setLoad`` takes the
    same three quantities.
    """

    name: ClassVar[str] = "franka"
    file: ClassVar[str] = "endeffector-config.json"
    title: ClassVar[str] = "end-effector configuration of Franka"

    def text(self, body: Body, title: str) -> str:
        """Writes the configuration."""
        data = {
            "id": "identified-payload",
            "name": title,
            "color": "#808080",
            "mass": body.mass,
            "centerOfMass": body.centre.tolist(),
            "transformation": np.eye(4).ravel(order="F").tolist(),
            "inertia": body.inertia.ravel(order="F").tolist(),
        }
        return json.dumps(data, indent=2, allow_nan=False) + "\n"
