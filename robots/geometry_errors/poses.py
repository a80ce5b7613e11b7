"""Measured poses: joint positions, what an instrument saw at each, and the conditions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.geometry_errors.measurements import Measurement
from robots.geometry_errors.state import ArmState, gravity_loads
from robots.robot import Robot

STILL = 1e-3
"""Steps between poses that are no motion of a joint [rad or m]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredPoses:
    """N poses of a robot and what was measured at each.

    Attributes:
        q: joint positions as the controller reads them (N, n) [rad or m].
        measurement: the kind of measurement.
        observed: what was measured (N, c), NaN where nothing was.
        second: joint positions of the second arm (N, n2); None with one arm.
        t: time [s] (N,); None where it is not known.
        session: number of the session (N,); None if there is one.
        temperature: of the arm (N,) [degC]; None where it was not measured.
        velocity: of the joints (N, n) [rad/s or m/s]; None if they stood still.
        approach: direction in which each joint came to the pose (N, n); None where it is not known.
        torque: of gravity at the joints, of an identified model (N, n) [N m or N]; None for that of the description.
        known: parts of the setup that are known and not estimated, by name: a pose (4, 4), a point (3,) [m].
        line: line of the file of each pose, from 1.
        source: the file, and what is known of it.

    Raises:
        InputError: shapes that do not fit, or joint positions that are not finite.
    """

    q: Array
    measurement: Measurement
    observed: Array
    second: Array | None = None
    t: Array | None = None
    session: NDArray[np.int64] | None = None
    temperature: Array | None = None
    velocity: Array | None = None
    approach: Array | None = None
    torque: Array | None = None
    known: Mapping[str, Array] = field(default_factory=dict)
    line: NDArray[np.int64] | None = None
    source: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        q = np.asarray(self.q, dtype=float)
        observed = np.asarray(self.observed, dtype=float)
        if q.ndim != 2 or not np.isfinite(q).all():
            raise InputError("joint positions are not finite numbers of shape (N, n)")
        if observed.shape != (len(q), len(self.measurement.columns)):
            raise InputError(
                f"measurements of shape {observed.shape}", allowed=f"({len(q)}, {len(self.measurement.columns)})"
            )
        if (self.second is not None) != (self.measurement.arms == 2):
            raise InputError("joint positions of a second arm belong to a part held by both arms, and to nothing else")
        object.__setattr__(self, "q", q)
        object.__setattr__(self, "observed", observed)
        if self.line is None:
            object.__setattr__(self, "line", np.arange(1, len(q) + 1))

    def __len__(self) -> int:
        return len(self.q)

    def part(self, rows: Any) -> MeasuredPoses:
        """Takes some of the poses.

        Args:
            rows: their numbers, from 0, or a mask (N,).
        """
        names = ("q", "observed", "second", "t", "session", "temperature", "velocity", "approach", "torque", "line")
        parts: dict[str, Any] = {name: None if (v := getattr(self, name)) is None else v[rows] for name in names}
        return replace(self, **parts)

    def states(self, *robots: Robot, reference: float | None = None) -> tuple[ArmState, ...]:
        """Gives what the errors of each arm depend on.

        Args:
            robots: one per arm.
            reference: temperature at which the description holds [degC]; the mean of the poses by default.
        """
        warmth = None
        if self.temperature is not None:
            warmth = self.temperature - (float(self.temperature.mean()) if reference is None else reference)
        states = []
        for robot, q in zip(robots, (self.q, self.second), strict=False):
            assert q is not None
            if q.shape[1] != robot.n:
                raise InputError(f"poses of {q.shape[1]} joints", allowed=f"{robot.n}, as {robot.name} has")
            first = q is self.q
            load = gravity_loads(robot, q) if robot.has_masses else None
            if first and self.torque is not None:
                load = _with_torque(robot, load, self.torque)
            states.append(
                ArmState(
                    q=q,
                    load=load,
                    temperature=warmth,
                    approach=self.approach if first else None,
                    velocity=self.velocity if first else None,
                    session=self.session if first else None,
                )
            )
        return tuple(states)


def approaches(q: Array) -> Array:
    """Direction in which each joint came to a pose, if the poses were visited in order: 1, -1, or that before (N, n).

    A joint that stayed keeps the direction of its last motion; 0 before its first one.

    Args:
        q: (N, n) [rad or m].
    """
    steps = np.diff(q, axis=0, prepend=q[:1])
    signs = np.where(np.abs(steps) > STILL, np.sign(steps), 0.0)
    last = np.where(signs != 0.0, np.arange(len(q))[:, None], 0)
    return np.take_along_axis(signs, np.maximum.accumulate(last, axis=0), axis=0)


def _with_torque(robot: Robot, load: Array | None, torque: Array) -> Array:
    """Loads whose part along each axis is the torque of an identified model."""
    result = np.zeros((*torque.shape, 6)) if load is None else load.copy()
    for i, joint in enumerate(robot.chain.joints):
        part = slice(0, 3) if joint.kind == "prismatic" else slice(3, 6)
        result[:, i, part] += (torque[:, i] - result[:, i, part] @ joint.axis)[:, None] * joint.axis
    return result
