"""How a controller counts the axes of a robot: signs, zeros and couplings beside the joints of the description."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from robots.common.arrays import Array
from robots.common.errors import InputError


@dataclass(frozen=True, kw_only=True, eq=False)
class ControllerAxes:
    """Axes a of a controller from joints q: ``a = sign (q + coupling q) + zero``.

    Args:
        sign: 1 or -1 (n,).
        zero: reading of each axis where all joints are at zero (n,) [rad or m].
        coupling: (n, n); row i is the share of each other joint that axis i contains, such as -1 for a parallelogram.

    Raises:
        InputError: arrays of other shapes, another sign, or axes that do not determine the joints.
    """

    sign: Array
    zero: Array
    coupling: Array

    def __post_init__(self) -> None:
        n = len(np.atleast_1d(self.sign))
        for name, shape in (("sign", (n,)), ("zero", (n,)), ("coupling", (n, n))):
            array = np.array(getattr(self, name), dtype=np.float64)
            if array.shape != shape or not np.isfinite(array).all():
                raise InputError(f"shape {array.shape}", column=name, allowed=f"finite numbers of the shape {shape}")
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        if (np.abs(self.sign) != 1).any():
            joint = int(np.argmax(np.abs(self.sign) != 1))
            raise InputError(f"found {self.sign[joint]:g}", column="sign", joint=joint + 1, allowed="1 or -1")
        if abs(np.linalg.det(np.eye(n) + self.coupling)) < 1e-6:
            raise InputError("the axes do not determine the joints", column="couplings")

    def axes(self, q: ArrayLike) -> Array:
        """Gives the axes at joint positions (N, n)."""
        q = np.asarray(q, dtype=np.float64)
        return self.sign * (q + q @ self.coupling.T) + self.zero

    def joints(self, axes: ArrayLike) -> Array:
        """Gives the joint positions at axes (N, n)."""
        turned = self.sign * (np.asarray(axes, dtype=np.float64) - self.zero)
        solved = np.linalg.inv(np.eye(len(self.sign)) + self.coupling) @ turned.T
        return np.asarray(solved.T, dtype=np.float64)


def axes_of(axes: ControllerAxes | None, q: ArrayLike) -> Array:
    """Gives the axes of a controller in degrees at joint positions (N, n) [rad]; the joints where nothing is stated."""
    return np.rad2deg(np.asarray(q, dtype=np.float64) if axes is None else axes.axes(q))


def joints_of(axes: ControllerAxes | None, degrees: ArrayLike) -> Array:
    """Gives the joint positions (N, n) [rad] from the axes of a controller [deg]."""
    turned = np.deg2rad(np.asarray(degrees, dtype=np.float64))
    return turned if axes is None else axes.joints(turned)
