"""What a robot does (`Motion`) and did (`Log`): arrays that are checked once and cannot change afterwards."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robots.common.errors import InputError

FloatArray = NDArray[np.float64]

JITTER = 1e-6
"""Relative deviation of a time step from the mean step up to which a signal counts as uniform."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Positions, velocities and accelerations of n joints at N instants.

    Args:
        t: time [s], (N,), increasing; the start is arbitrary and the steps may differ.
        q: joint positions [rad, or m of a prismatic joint], (N, n).
        dq: joint velocities [rad/s], (N, n).
        ddq: joint accelerations [rad/s^2], (N, n).

    Raises:
        InputError: an array of another shape, a value that is not finite, or a time that does not increase.
    """

    t: FloatArray
    q: FloatArray
    dq: FloatArray
    ddq: FloatArray

    def __post_init__(self) -> None:
        t = _time(self.t)
        q = _joint_signal("q", self.q, len(t), None)
        _freeze(self, t=t, q=q)
        for name in ("dq", "ddq"):
            _freeze(self, **{name: _joint_signal(name, getattr(self, name), len(t), q.shape[1])})

    def __len__(self) -> int:
        return len(self.t)

    def __reduce__(self) -> tuple[Any, ...]:
        # A default pickle would return writable arrays.
        return _rebuild, (type(self), {item.name: getattr(self, item.name) for item in fields(self)})

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
            InputError: no motion, another number of joints, times that do not increase, or nothing to tell the step.
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
                    raise InputError(f"motion {index - 1} has one sample: its step is unknown", remedy="set the times")
                offset = float(times[-1][-1] + (before.t[-1] - before.t[-2]) - motion.t[0])
            times.append(motion.t + offset)
        parts = (np.concatenate([getattr(motion, name) for motion in motions]) for name in ("q", "dq", "ddq"))
        return Motion(np.concatenate(times), *parts)


@dataclass(frozen=True, eq=False)
class Log:
    """What was recorded of a motion of n joints at N instants.

    Args:
        t: time [s], (N,), increasing; one clock for all logs of a campaign.
        q: joint positions [rad], (N, n).
        tau: joint torques [N m], (N, n); without torque and current the log is of a motion only.
        current: motor currents [A], (N, n).
        dq: joint velocities [rad/s], (N, n).
        ddq: joint accelerations [rad/s^2], (N, n).
        temperature: joint temperatures [degC], (N, n); NaN where a sensor was silent.
        ambient: temperature of the surroundings [degC], (N,); NaN where the sensor was silent.
        qlink: positions behind the gears [rad], (N, n); NaN throughout for a joint that has no encoder there.
        segment: whole number of the part of an experiment, (N,).
        cycle: whole number of the repetition of an experiment, (N,).
        payload: a known payload, (10,) in the flange's frame: mass [kg], mass times centre [kg m], inertia about the
            frame's origin xx xy xz yy yz zz [kg m2]; None for none.
        name: a short name for reports.
        metadata: anything else that is known of the recording.

    Raises:
        InputError: an array of another shape, a value that is not finite, or a time that does not increase. Its column
            is the field, its row the sample, counted from 1.
    """

    t: FloatArray
    q: FloatArray
    tau: FloatArray | None = None
    current: FloatArray | None = None
    dq: FloatArray | None = None
    ddq: FloatArray | None = None
    temperature: FloatArray | None = None
    ambient: FloatArray | None = None
    qlink: FloatArray | None = None
    segment: FloatArray | None = None
    cycle: FloatArray | None = None
    payload: FloatArray | None = None
    name: str = ""
    metadata: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        t = _time(self.t)
        q = _joint_signal("q", self.q, len(t), None)
        _freeze(self, t=t, q=q)
        for name in _PER_JOINT:
            value = getattr(self, name)
            if value is not None:
                nan_allowed = name in ("temperature", "qlink")
                _freeze(self, **{name: _joint_signal(name, value, len(t), q.shape[1], nan_allowed=nan_allowed)})
        if self.qlink is not None:
            _require_finite("qlink", np.where(np.isnan(self.qlink).all(axis=0), 0.0, self.qlink), joints=True)
        for name in _COMMON:
            value = getattr(self, name)
            if value is not None:
                _freeze(self, **{name: _common_signal(name, value, len(t))})
        if self.payload is not None:
            _freeze(self, payload=_body(self.payload))
        object.__setattr__(self, "metadata", dict(self.metadata))

    def __len__(self) -> int:
        return len(self.t)

    def __reduce__(self) -> tuple[Any, ...]:
        return _rebuild, (type(self), {item.name: getattr(self, item.name) for item in fields(self)})

    @property
    def n(self) -> int:
        """The number of joints."""
        return int(self.q.shape[1])

    @property
    def has_torque(self) -> bool:
        """Whether joint torques were recorded (or computed) and not only currents."""
        return self.tau is not None

    @property
    def duration(self) -> float:
        """The time from the first to the last sample [s]."""
        return float(self.t[-1] - self.t[0])

    @property
    def period(self) -> float | None:
        """The sample period [s], or None if the steps differ by more than a part in 10^6."""
        return uniform_period(self.t)

    def rows(self, part: slice) -> Log:
        """Returns the log of some of the samples.

        Args:
            part: which samples, as in ``array[part]``.

        Raises:
            InputError: no sample is left, or the slice runs backward.
        """
        cut = {"t", "q", *_PER_JOINT, *_COMMON}
        values = {item.name: getattr(self, item.name) for item in fields(self)}
        return Log(**{key: value[part] if key in cut and value is not None else value for key, value in values.items()})


def _body(value: ArrayLike) -> FloatArray:
    body = np.array(value, dtype=float)
    if body.shape != (10,) or not np.isfinite(body).all() or body[0] < 0:
        raise InputError(
            f"a payload of {np.array2string(body, threshold=12)}",
            column="payload",
            allowed="ten numbers: a mass of 0 or more, mass times centre, inertia xx xy xz yy yz zz",
        )
    return body


_PER_JOINT = ("tau", "current", "dq", "ddq", "temperature", "qlink")
_COMMON = ("ambient", "segment", "cycle")


def uniform_period(t: FloatArray) -> float | None:
    """Returns the sample period of increasing times, or None if they are uneven or a single one.

    Args:
        t: time [s], (N,).
    """
    if len(t) < 2:
        return None
    period = float(t[-1] - t[0]) / (len(t) - 1)
    # Times far from zero, such as those since 1970, carry a rounding error that is no jitter.
    rounding = 2.0 * float(np.spacing(np.abs(t[[0, -1]]).max()))
    even = bool(np.abs(np.diff(t) - period).max() <= JITTER * period + rounding)
    return period if even else None


def _time(value: ArrayLike) -> FloatArray:
    t = _array("t", value, 1)
    if len(t) == 0:
        raise InputError("no samples", column="t", allowed="one or more")
    _require_finite("t", t[:, None], joints=False)
    backward = np.flatnonzero(np.diff(t) <= 0.0)
    if len(backward):
        first = int(backward[0])
        times = f"{float(t[first + 1])!r} after {float(t[first])!r}"
        verb = "repeats" if t[first + 1] == t[first] else "runs backward"
        raise InputError(
            f"time {verb}: {times}{_more(len(backward))}", column="t", row=first + 2, allowed="increasing times"
        )
    return t


def _joint_signal(
    name: str, value: ArrayLike, rows: int, joints: int | None, *, nan_allowed: bool = False
) -> FloatArray:
    array = _array(name, value, 2)
    if array.shape[0] != rows:
        raise InputError(f"{array.shape[0]} rows, but t has {rows}", column=name)
    if array.shape[1] == 0 or joints not in (None, array.shape[1]):
        raise InputError(f"{array.shape[1]} joints", column=name, allowed=f"{joints or '1 or more'}")
    _require_finite(name, array, joints=True, nan_allowed=nan_allowed)
    return array


def _common_signal(name: str, value: ArrayLike, rows: int) -> FloatArray:
    array = _array(name, value, 1)
    if len(array) != rows:
        raise InputError(f"{len(array)} rows, but t has {rows}", column=name)
    _require_finite(name, array[:, None], joints=False, nan_allowed=name == "ambient")
    broken = np.flatnonzero(array != np.round(array)) if name != "ambient" else np.empty(0, int)
    if len(broken):
        first = int(broken[0])
        raise InputError(f"found {float(array[first])!r}", column=name, row=first + 1, allowed="whole numbers")
    return array


def _array(name: str, value: ArrayLike, dimensions: int) -> FloatArray:
    shape = "(N,)" if dimensions == 1 else "(N, n)"
    try:
        given = np.asarray(value)
        if given.dtype.kind not in "biuf":
            raise TypeError(f"dtype {given.dtype}")
        array = np.array(given, dtype=np.float64, order="C")
    except (TypeError, ValueError) as error:
        raise InputError(f"not an array of numbers ({error})", column=name, allowed=f"numbers, {shape}") from error
    if array.ndim != dimensions:
        raise InputError(f"shape {array.shape}", column=name, allowed=f"shape {shape}")
    return array


def _require_finite(name: str, array: FloatArray, *, joints: bool, nan_allowed: bool = False) -> None:
    bad = np.isinf(array) if nan_allowed else ~np.isfinite(array)
    if not bad.any():
        return
    row, column = (int(index) for index in np.argwhere(bad)[0])
    raise InputError(
        f"found {float(array[row, column])}{_more(int(bad[:, column].sum()))}",
        column=name,
        row=row + 1,
        joint=column + 1 if joints else None,
        allowed="finite numbers, or nan where a sensor was silent" if nan_allowed else "finite numbers",
    )


def _more(count: int) -> str:
    return f" (the first of {count})" if count > 1 else ""


def _freeze(owner: object, **arrays: FloatArray) -> None:
    for name, array in arrays.items():
        array.setflags(write=False)
        object.__setattr__(owner, name, array)


def _rebuild(kind: type[Motion] | type[Log], values: dict[str, Any]) -> Motion | Log:
    return kind(**values)
