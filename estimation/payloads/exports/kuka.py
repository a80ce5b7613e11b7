"""KUKA: the load data of a tool."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from estimation.payloads.body import Body
from estimation.payloads.exports.base import PayloadExport, number

Array = NDArray[np.float64]


class Kuka(PayloadExport):
    """``LOAD_DATA[1]={M ..,CM {X ..,Y ..,Z ..,A ..,B ..,C ..},J {X ..,Y ..,Z ..}}`` for ``$config.dat``.

    Mass M [kg]; centre of mass X, Y, Z [mm] in the FLANGE frame; A, B, C [deg] turn that frame to the principal axes of
    inertia: A about Z, then B about the new Y, then C about the new X; J: principal moments of inertia about the centre
    of mass [kg m2] (KUKA, KR IONTEC, technical data, "Load center of gravity and mass moment of inertia",
    https://www.easymanua.ls/kuka/iontec-kr-20-r3100/manual?p=40; the fields of the load data:
    https://infosys.beckhoff.com/content/1033/tf5120/13081587595.html).
    """

    name: ClassVar[str] = "kuka"
    file: ClassVar[str] = "load_data.dat"
    title: ClassVar[str] = "load data of KUKA"

    def text(self, body: Body, title: str) -> str:
        """Writes the assignment."""
        moments, axes = body.principal
        pairs = [
            _fields("XYZ", 1000 * body.centre),
            _fields("ABC", np.degrees(zyx_angles(axes))),
            _fields("XYZ", moments),
        ]
        return (
            f"; {title}\n"
            "; M [kg], CM [mm] and its principal axes [deg] in the FLANGE frame, J about the centre of mass [kg m2].\n"
            "; Replace the index by the number of the tool.\n"
            f"LOAD_DATA[1]={{M {number(body.mass)},CM {{{pairs[0]},{pairs[1]}}},J {{{pairs[2]}}}}}\n"
        )


def zyx_angles(rotation: Array) -> Array:
    """Gives A, B, C (3,) [rad] with ``R = Rz(A) Ry(B) Rx(C)`` of a rotation matrix (3, 3)."""
    level = float(np.hypot(rotation[0, 0], rotation[1, 0]))
    b = np.arctan2(-rotation[2, 0], level)
    if level < 1e-9:  # A and C turn about one axis: all of it goes to A
        return np.array([np.arctan2(-rotation[0, 1], rotation[1, 1]), b, 0.0])
    return np.array([np.arctan2(rotation[1, 0], rotation[0, 0]), b, np.arctan2(rotation[2, 1], rotation[2, 2])])


def _fields(names: str, values: Array) -> str:
    return ",".join(f"{name} {number(value)}" for name, value in zip(names, values, strict=True))
