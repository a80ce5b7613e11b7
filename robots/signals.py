"""What a robot does (`Motion`) and did (`Log`): arrays that are checked once and cannot change afterwards."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robots.common.arrays import Array
from robots.common.errors import InputError
from robots.common.plain import as_html
from robots.signal_checks import (
    checked_body,
    checked_common,
    checked_gravity,
    checked_joints,
    checked_time,
    require_finite,
)

UNKNOWN_PAUSE = 60.0
"""Pause [s] assumed between two logs where it was not recorded."""


_SIGNALS = ("q", "command", "dq", "ddq", "tau", "current", "temperature")


@dataclass(frozen=True, eq=False)
class _Samples:
    """Joint positions at increasing times, which may come with more.

    Attributes:
        t: time [s], (N,).
        q: positions [rad or m], (N, n).
    """

    t: Array
    q: Array

    def __len__(self) -> int:
        return len(self.t)

    def __reduce__(self) -> tuple[Any, ...]:
        # A default pickle would return writable arrays.
        return _rebuild, (type(self), {item.name: getattr(self, item.name) for item in fields(self)})

    def __repr__(self) -> str:
        own = getattr(self, "name", "")
        name = f"{own!r}, " if own else ""
        held = [key for key in _SIGNALS if getattr(self, key, None) is not None]
        span = f"{self.t[0]:.6g} to {self.t[-1]:.6g} s"
        return f"{type(self).__name__}({name}{len(self)} samples, {self.n} joints, {span}, {', '.join(held)})"

    def _repr_html_(self) -> str:
        lines = [repr(self), "", "least to most    " + "".join(f"{f'joint {j + 1}':>22}" for j in range(self.n))]
        for key in _SIGNALS:
            values = getattr(self, key, None)
            if values is not None:
                ends = zip(np.nanmin(values, axis=0), np.nanmax(values, axis=0), strict=True)
                lines.append(f"{key:16} " + "".join(f"{f'{low:.4g} to {high:.4g}':>22}" for low, high in ends))
        return as_html("\n".join(lines))

    @property
    def n(self) -> int:
        """The number of joints."""
        return int(self.q.shape[1])

    @property
    def duration(self) -> float:
        """The time from the first to the last sample [s]."""
        return float(self.t[-1] - self.t[0])

    @property
    def period(self) -> float | None:
        """The sample period [s], or None if the steps differ by more than a part in 10^6."""
        return uniform_period(self.t)


@dataclass(frozen=True, eq=False, repr=False)
class Motion(_Samples):
    """Positions, velocities and accelerations of n joints at N instants.

    Args:
        t: time [s], (N,), increasing; the start is arbitrary and the steps may differ.
        q: joint positions [rad, or m of a prismatic joint], (N, n).
        dq: joint velocities [rad/s], (N, n).
        ddq: joint accelerations [rad/s^2], (N, n).

    Raises:
        InputError: an array of another shape, a value that is not finite, or a time that does not increase.
    """

    t: Array
    q: Array
    dq: Array
    ddq: Array

    def __post_init__(self) -> None:
        t = checked_time(self.t)
        q = checked_joints("q", self.q, len(t), None)
        _freeze(self, t=t, q=q)
        for name in ("dq", "ddq"):
            _freeze(self, **{name: checked_joints(name, getattr(self, name), len(t), q.shape[1])})

    def slice(self, start_index: int | None, stop_index: int | None) -> Motion:
        """Returns the samples from ``start_index`` up to, not including, ``stop_index``.

        Args:
            start_index: index of the first sample; None for the beginning.
            stop_index: index after the last sample; None for the end.

        Raises:
            InputError: no sample is left.
        """
        part = slice(start_index, stop_index)
        return Motion(self.t[part], self.q[part], self.dq[part], self.ddq[part])

    @staticmethod
    def concatenate(motions: Sequence[Motion], *, shift: bool = False) -> Motion:
        """Joins motions one after the other.

        Args:
            motions: at least one motion, all with the same number of joints.
            shift: False keeps all times, which must then increase from motion to motion; True moves each motion so
                that it begins one step (the last of the motion before) after the one before.

        Raises:
            InputError: no motion, another number of joints, times that do not increase, or nothing that shows the step.
        """
        motions = list(motions)
        if not motions:
            raise InputError("no motion to concatenate", allowed="one or more")
        times = [motions[0].t]
        for index, (before, motion) in enumerate(pairwise(motions), start=2):
            if motion.n != motions[0].n:
                raise InputError(f"motion {index} has {motion.n} joints, the first {motions[0].n}")
            offset = 0.0
            if shift:
                if len(before) < 2:
                    raise InputError(
                        f"motion {index - 1} has one sample, so its time step is unknown", remedy="set the start times"
                    )
                offset = float(times[-1][-1] + (before.t[-1] - before.t[-2]) - motion.t[0])
            times.append(motion.t + offset)
        parts = (np.concatenate([getattr(motion, name) for motion in motions]) for name in ("q", "dq", "ddq"))
        return Motion(np.concatenate(times), *parts)


@dataclass(frozen=True, eq=False, repr=False)
class Log(_Samples):
    """What was recorded of a motion of n joints at N instants.

    Args:
        t: time [s], (N,), increasing; one clock for all logs of a campaign.
        q: joint positions [rad], (N, n).
        tau: joint torques [N m], (N, n); without torque and current the log is of a motion only.
        current: motor currents [A], (N, n).
        dq: joint velocities [rad/s], (N, n).
        ddq: joint accelerations [rad/s^2], (N, n).
        temperature: joint temperatures [degC], (N, n); NaN where a sensor was silent.
        ambient: ambient temperature [degC], (N,); NaN where the sensor was silent.
        qlink: positions behind the gears [rad], (N, n); NaN throughout for a joint that has no encoder there.
        command: commanded joint positions [rad], (N, n), as the controller had them at these times.
        segment: whole number of the part of an experiment, (N,).
        cycle: whole number of the repetition of an experiment, (N,).
        payload: a known payload, (10,) in the flange's frame: mass [kg], mass times centre [kg m], inertia about the
            frame's origin xx xy xz yy yz zz [kg m2]; None for none.
        gravity: gravity's acceleration (3,) in the base frame [m/s2], where the base stood otherwise than the robot's
            description says, as tilted or on a wall; None as described.
        name: a short name for reports.
        metadata: anything else that is known of the recording.

    Raises:
        InputError: an array of another shape, a value that is not finite, or a time that does not increase. Its column
            is the field, its row the sample, counted from 1.
    """

    t: Array
    q: Array
    tau: Array | None = None
    current: Array | None = None
    dq: Array | None = None
    ddq: Array | None = None
    temperature: Array | None = None
    ambient: Array | None = None
    qlink: Array | None = None
    command: Array | None = None
    segment: Array | None = None
    cycle: Array | None = None
    payload: Array | None = None
    gravity: Array | None = None
    name: str = ""
    metadata: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        t = checked_time(self.t)
        q = checked_joints("q", self.q, len(t), None)
        _freeze(self, t=t, q=q)
        for name in _PER_JOINT:
            value = getattr(self, name)
            if value is not None:
                nan_allowed = name in ("temperature", "qlink")
                _freeze(self, **{name: checked_joints(name, value, len(t), q.shape[1], nan_allowed=nan_allowed)})
        if self.qlink is not None:
            require_finite("qlink", np.where(np.isnan(self.qlink).all(axis=0), 0.0, self.qlink), joints=True)
        for name in _COMMON:
            value = getattr(self, name)
            if value is not None:
                _freeze(self, **{name: checked_common(name, value, len(t))})
        if self.payload is not None:
            _freeze(self, payload=checked_body(self.payload))
        if self.gravity is not None:
            _freeze(self, gravity=checked_gravity(self.gravity))
        object.__setattr__(self, "metadata", dict(self.metadata))

    @property
    def has_torque(self) -> bool:
        """Whether joint torques were recorded (or computed) and not only currents."""
        return self.tau is not None

    def rows(self, part: slice | NDArray[np.intp]) -> Log:
        """Returns the log of some of the samples.

        Args:
            part: which samples, as in ``array[part]``: a slice, or increasing indices (K,).

        Raises:
            InputError: no sample is left, or the slice runs backward.
        """
        cut = {"t", "q", *_PER_JOINT, *_COMMON}
        values = {item.name: getattr(self, item.name) for item in fields(self)}
        return Log(**{key: value[part] if key in cut and value is not None else value for key, value in values.items()})


_PER_JOINT = ("tau", "current", "dq", "ddq", "temperature", "qlink", "command")
_COMMON = ("ambient", "segment", "cycle")


def uniform_period(t: Array) -> float | None:
    """Returns the sample period of increasing times, or None if they are uneven or a single one.

    Args:
        t: time [s], (N,).
    """
    if len(t) < 2:
        return None
    period = float(t[-1] - t[0]) / (len(t) - 1)
    # Times far from zero, such as those since 1970, carry a rounding error that is no jitter.
    rounding = 2.0 * float(np.spacing(np.abs(t[[0, -1]]).max()))
    # Relative deviation of a time step from the mean step up to which a signal counts as uniform.
    even = bool(np.abs(np.diff(t) - period).max() <= 1e-6 * period + rounding)
    return period if even else None


def _freeze(owner: object, **arrays: Array) -> None:
    for name, array in arrays.items():
        array.setflags(write=False)
        object.__setattr__(owner, name, array)


def _rebuild(kind: type[_Samples], values: dict[str, Any]) -> _Samples:
    return kind(**values)
