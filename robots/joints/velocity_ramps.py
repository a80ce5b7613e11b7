"""Velocity limits that fall towards the ends of a joint, so that it can brake before them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from robots.common.arrays import Array
from robots.common.errors import InputError

NO_RAMP = {"lower": -1e6, "upper": 1e6, "offset": 0.0, "deceleration": 1e6, "reserve": 0.0}
"""Values of a joint that has no such limit."""


@dataclass(frozen=True, kw_only=True, eq=False)
class VelocityRamp:
    """A joint may move towards an end no faster than ``share (sqrt(2 a distance) - offset) - reserve``.

    The velocity limit of the joint holds besides.

    Args:
        lower: lower ends, from which the distance is measured (n,) [rad or m].
        upper: upper ends (n,) [rad or m].
        offset: speed that is taken off (n,) [rad/s or m/s].
        deceleration: a, with which the joint is to brake (n,) [rad/s2 or m/s2].
        reserve: speed that is kept back besides (n,) [rad/s or m/s].
        share: of the limit that is used.

    Raises:
        InputError: arrays of different lengths, lower ends that are not below upper ones, a negative offset or
            reserve, or a deceleration that is not positive.
    """

    lower: Array
    upper: Array
    offset: Array
    deceleration: Array
    reserve: Array
    share: float = 1.0

    def __post_init__(self) -> None:
        for name in NO_RAMP:
            array = np.array(getattr(self, name), dtype=np.float64)
            array.setflags(write=False)
            object.__setattr__(self, name, array)
            if array.shape != self.lower.shape or array.ndim != 1 or not np.isfinite(array).all():
                raise InputError(f"shape {array.shape}", column=name, allowed="one finite number for each joint")
        for wrong, name, allowed in (
            (self.lower >= self.upper, "lower", "lower < upper"),
            (self.offset < 0, "offset", "zero or more"),
            (self.reserve < 0, "reserve", "zero or more"),
            (self.deceleration <= 0, "deceleration", "above zero"),
        ):
            if wrong.any():
                joint = int(np.argmax(wrong))
                raise InputError(f"found {getattr(self, name)[joint]:g}", column=name, joint=joint + 1, allowed=allowed)

    def scaled(self, share: float) -> VelocityRamp:
        """Gives a share of the limit."""
        return replace(self, share=self.share * share)

    def towards(self, q: ArrayLike, sign: float) -> Array:
        """Gives the highest speed towards the upper ends (sign 1) or the lower ones (-1) at positions (N, n)."""
        distance = self.upper - np.asarray(q) if sign > 0 else np.asarray(q) - self.lower
        speed = np.sqrt(np.maximum(2 * self.deceleration * distance, 0.0)) - self.offset - self.reserve
        return self.share * np.maximum(speed, 0.0)

    def allowed(self, q: ArrayLike, dq: ArrayLike, velocity: ArrayLike) -> Array:
        """Gives the limit of the speed in the direction of motion at states (N, n); `velocity` (n,) holds besides."""
        ramp = np.where(np.asarray(dq) > 0, self.towards(q, 1.0), self.towards(q, -1.0))
        return np.minimum(ramp, np.asarray(velocity))
