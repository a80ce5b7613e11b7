"""Checks of what a signal holds: its shape, finite numbers, increasing times; each names column, row and joint."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from robots.common.arrays import Array
from robots.common.errors import InputError


def checked_time(value: ArrayLike) -> Array:
    """Gives increasing times (N,)."""
    t = _array("t", value, 1)
    if len(t) == 0:
        raise InputError("no samples", column="t", allowed="one or more")
    require_finite("t", t[:, None], joints=False)
    backward = np.flatnonzero(t[1:] <= t[:-1])
    if len(backward):
        first = int(backward[0])
        times = f"{float(t[first + 1])!r} after {float(t[first])!r}"
        verb = "repeats" if t[first + 1] == t[first] else "runs backward"
        raise InputError(
            f"time {verb}: {times}{_more(len(backward))}", column="t", row=first + 2, allowed="increasing times"
        )
    return t


def checked_joints(name: str, value: ArrayLike, rows: int, joints: int | None, *, nan_allowed: bool = False) -> Array:
    """Gives a signal (N, n) of all joints."""
    array = _array(name, value, 2)
    if array.shape[0] != rows:
        raise InputError(f"{array.shape[0]} rows, but t has {rows}", column=name)
    if array.shape[1] == 0 or joints not in (None, array.shape[1]):
        raise InputError(f"{array.shape[1]} joints", column=name, allowed=f"{joints or '1 or more'}")
    require_finite(name, array, joints=True, nan_allowed=nan_allowed)
    return array


def checked_common(name: str, value: ArrayLike, rows: int) -> Array:
    """Gives a signal (N,) that all joints share: whole numbers, but for the ambient temperature."""
    array = _array(name, value, 1)
    if len(array) != rows:
        raise InputError(f"{len(array)} rows, but t has {rows}", column=name)
    require_finite(name, array[:, None], joints=False, nan_allowed=name == "ambient")
    broken = np.flatnonzero(array != np.round(array)) if name != "ambient" else np.empty(0, int)
    if len(broken):
        first = int(broken[0])
        raise InputError(f"found {float(array[first])!r}", column=name, row=first + 1, allowed="whole numbers")
    return array


def _array(name: str, value: ArrayLike, dimensions: int) -> Array:
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


def require_finite(name: str, array: Array, *, joints: bool, nan_allowed: bool = False) -> None:
    """Refuses infinite numbers (N, k), and NaN where no sensor may be silent, naming the first row."""
    bad = np.isinf(array) if nan_allowed else ~np.isfinite(array)
    if not bad.any():
        return
    row, column = (int(index) for index in np.argwhere(bad)[0])
    raise InputError(
        f"found {float(array[row, column])}{_more(int(bad[:, column].sum()))}",
        column=name,
        row=row + 1,
        joint=column + 1 if joints else None,
        allowed="finite numbers, or nan where a sensor gave no value" if nan_allowed else "finite numbers",
    )


def _more(count: int) -> str:
    return f" (the first of {count})" if count > 1 else ""


def checked_body(value: ArrayLike) -> Array:
    """Gives ten inertial parameters of a body."""
    body = _numbers("payload", value)
    if body.shape != (10,) or not np.isfinite(body).all() or body[0] < 0:
        raise InputError(
            f"a payload of {np.array2string(body, threshold=12)}",
            column="payload",
            allowed="ten numbers: a mass of 0 or more, mass times centre, inertia xx xy xz yy yz zz",
        )
    return body


def checked_gravity(value: ArrayLike) -> Array:
    """Gives gravity's acceleration (3,)."""
    gravity = _numbers("gravity", value)
    if gravity.shape != (3,) or not np.isfinite(gravity).all():
        raise InputError(
            f"a gravity of {np.array2string(gravity, threshold=12)}",
            column="gravity",
            allowed="three finite numbers [m/s2], in the base frame",
        )
    return gravity


def _numbers(name: str, value: ArrayLike) -> Array:
    try:
        return np.array(value, dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError(f"a {name} of {value!r}", column=name, allowed="numbers") from error
