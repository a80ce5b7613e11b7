"""Where instruments, markers and touched things are: what a calibration estimates beside the robot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from robots.common.arrays import Array
from robots.geometry_errors.terms.base import ErrorParameter, parameter
from robots.geometry_errors.twists import exponential

AXES = ("x", "y", "z", "rx", "ry", "rz")


@dataclass(frozen=True, kw_only=True, eq=False)
class Unknown:
    """A pose, rotation, direction, point, or numbers.

    Attributes:
        kind: "pose" (4, 4), "rotation" (3, 3), "direction" (3,) of unit length, "point" (3,), or "number" (k,).
        value: the estimate [m].
        known: whether it is not estimated.
        labels: what each of several numbers is called.
        unit: of numbers.
        scale: usual size of a change of numbers.
    """

    kind: Literal["pose", "rotation", "direction", "point", "number"]
    value: Array
    known: bool = False
    labels: tuple[str, ...] = ()
    unit: str = "m"
    scale: float = 1e-3

    @property
    def size(self) -> int:
        """Number of parameters."""
        return {"pose": 6, "rotation": 3, "direction": 2, "point": 3, "number": self.value.size}[self.kind]

    def moved(self, step: Array) -> Unknown:
        """Gives it after a step of its parameters, which start at zero again."""
        if self.kind == "pose":
            value = self.value @ exponential(step)
        elif self.kind == "rotation":
            value = self.value @ exponential(np.concatenate([np.zeros(3), step]))[:3, :3]
        elif self.kind == "direction":
            value = self.value + tangents(self.value) @ step
            value = value / np.linalg.norm(value)
        else:
            value = self.value + step
        return replace(self, value=value)

    def parameters(self, name: str) -> tuple[ErrorParameter, ...]:
        """Lists its parameters."""
        if self.kind in ("pose", "point"):
            return tuple(
                parameter(f"{name}_{axis}", "setup", None, "m" if axis in "xyz" else "rad", 1e-3)
                for axis in AXES[: self.size]
            )
        if self.kind == "number":
            names = [f"{name}_{label}" for label in self.labels] or [name]
            return tuple(parameter(own, "setup", None, self.unit, self.scale) for own in names)
        return tuple(parameter(f"{name}_{AXES[3 + k]}", "setup", None, "rad", 1e-3) for k in range(self.size))


def tangents(direction: Array) -> Array:
    """Two unit vectors across a direction (3, 2)."""
    _, _, right = np.linalg.svd(direction[None, :])
    return np.asarray(right[1:].T)


Setup = Mapping[str, Unknown]
"""All of them by name."""


def setup_parameters(setup: Setup) -> tuple[ErrorParameter, ...]:
    """Lists the parameters of all that is estimated."""
    return tuple(item for name, part in setup.items() if not part.known for item in part.parameters(name))


def moved_setup(setup: Setup, step: Array) -> Setup:
    """Gives a setup after a step of its parameters."""
    moved, start = dict(setup), 0
    for name, part in setup.items():
        if not part.known:
            moved[name] = part.moved(step[start : start + part.size])
            start += part.size
    return moved


def known_setup(setup: Setup, values: Mapping[str, Array]) -> Setup:
    """Gives a setup in which some parts are known and stay as they are."""
    return {
        name: replace(part, value=values[name], known=True) if name in values else part for name, part in setup.items()
    }
